"""Nodes over the hemisphere for integrals of lobes and of facet distributions.

Each rule returns the frames N, T, V, L (float64 [n, 3] each) at its nodes, and their weights [n]. Nodes grow denser
towards where lobes are narrow, and the kinks that models commonly have are bounds of the rules. In double, for widths
from 0.05, they are exact to 1e-7 for GGX, and to some 1e-4 where V-grooves or widths of 1 : 10 put kinks or ridges
elsewhere.
"""

import numpy as np

from . import geometry


def graded(start, end, width, count):
    """Gauss-Legendre nodes and weights between two bounds, denser towards the start, down to a scale of `width`."""
    x, w = np.polynomial.legendre.leggauss(count)
    t, span = (x + 1) / 2, np.arcsinh(abs(end - start) / width)
    return start + np.sign(end - start) * width * np.sinh(span * t), w / 2 * span * width * np.cosh(span * t)


def joined(*pieces):
    return tuple(np.concatenate(arrays) for arrays in zip(*pieces))


def spherical(theta, phi):
    """Unit vectors [n, 3] about the normal (0, 0, 1)."""
    theta, phi = np.broadcast_arrays(theta, phi)
    return np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)], -1).reshape(-1, 3)


def framed(V, L, azimuth=0.0):
    """N, T, V, L as arrays of one shape; T lies in an azimuth."""
    return tuple(np.broadcast_to(x, L.shape) for x in (spherical(0.0, 0.0), spherical(np.pi / 2, azimuth), V, L))


def lights(view, tilts=40, turns=32):
    """Lights over the hemisphere for a view at an angle from the normal; the weights hold NdotL. The numbers of nodes
    are of each piece of the rule, two of tilt and four of azimuth.

    Denser about the mirror direction; split where NdotL = NdotV and where the azimuths of V and L are at right angles.
    Each view has its own azimuth of T, so that none of an anisotropic lobe's symmetries is favoured.
    """
    theta, theta_weight = joined(*(graded(view, end, 0.02, tilts) for end in (0, np.pi / 2)))
    phi, phi_weight = joined(*(graded(a, a + b, 0.02 * np.cos(view), turns)
                               for a in (np.pi, 0) for b in (-np.pi / 2, np.pi / 2)))
    weight = np.outer(theta_weight * np.sin(theta) * np.cos(theta), phi_weight).ravel()
    return framed(spherical(view, 0.0), spherical(theta[:, None], phi), azimuth=10 * view), weight


def facets(count: int = 128):
    """Half vectors over the hemisphere, as V = L = H; the weights hold NdotH.

    Denser about the normal and near the axes, where the ridge of an anisotropic distribution runs.
    """
    theta, theta_weight = graded(0, np.pi / 2, 0.02, count)
    phi, phi_weight = joined(*(graded(a, a + b, 0.01, 24)
                               for a in np.arange(4) * np.pi / 2 for b in (-np.pi / 4, np.pi / 4)))
    H = spherical(theta[:, None], phi)
    return framed(H, H), np.outer(theta_weight * np.sin(theta) * np.cos(theta), phi_weight).ravel()


def visible_facets(view):
    """Half vectors over the hemisphere with V.H > 0, as lights mirrored at them; the weights hold V.H.

    No node is lost: V.H = 0 is a bound of the rule.
    """
    split = np.pi / 2 - view  # facets tilted less are visible from everywhere
    middle = (split + np.pi / 2) / 2
    theta, theta_weight = joined(graded(0, split / 2, 0.02, 32), graded(split, split / 2, 1e-3, 32),
                                 graded(split, middle, 1e-3, 32), graded(np.pi / 2, middle, 0.05, 48))
    end = np.arccos(np.clip(-1 / np.tan(theta) / np.tan(max(view, 1e-9)), -1, 1))
    t, t_weight = np.polynomial.legendre.leggauss(48)
    V, H = spherical(view, 0.0), spherical(theta[:, None], end[:, None] * t)
    VdotH = np.sum(V * H, -1, keepdims=True)
    return framed(V, 2 * VdotH * H - V), np.outer(theta_weight * np.sin(theta) * end, t_weight).ravel() * VdotH[:, 0]


def integral(shade, expression, result, functions, sets, rules):
    """Integrals of a GLSL expression in the functions' parameters, [sets, rules, width], in double, of float32 values.

    shade   evaluates an expression over inputs
    sets    values of the parameters that are no geometry
    rules   frames and weights, each as a function here returns them
    """
    shape = (len(sets), len(rules), len(rules[0][1]))
    frame = [np.stack(vectors) for vectors in zip(*(frames for frames, _ in rules))]
    inputs = {}
    for p in (p for f in functions for p in f.parameters):
        if p.is_geometry:
            values = geometry.FORM[p.name](*frame)
        else:
            values = np.reshape([s[p.name] for s in sets], (-1, 1, 1, 1))
        inputs[p.name] = np.broadcast_to(values.astype(np.float32), (*shape, p.width)).reshape(-1, p.width)
    got = shade(expression, result, inputs).reshape(*shape, -1)
    return np.einsum("srnk,rn->srk", got, np.stack([weights for _, weights in rules]))
