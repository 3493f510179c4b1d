"""Draws follow their densities: chi-squared tests of every sampler, those of the reference and those of the shaders.

What a shader draws is held to the density of the reference. A bin's share of it comes from quadrature in coordinates
that are stretched as the lobe is, in which it is smooth however narrow it is.
"""

import math
from dataclasses import dataclass
from functools import cache

import numpy as np
import pytest
from scipy import stats

from lobe import reference
from lobe.lab import catalogue, gl

LIBRARY = catalogue.load()
FUNCTIONS = {f.name: f for f in reference.functions()}
IN_GLSL = {f.name: f for f in LIBRARY.functions}
SEED = 20260
SIGNIFICANCE = 0.01
WIDTHS, VIEWS = (0.02, 0.1, 0.5, 1), (0, 45, 80, 89)
SUBDIVISION = 6  # nodes per bin and axis
# T, B, N of the surface, an arbitrary rotation
FRAME = np.linalg.qr([[0.3, -0.5, 0.8], [0.9, 0.2, -0.1], [0.1, 0.7, 0.6]])[0]
FRAME[1] = np.cross(FRAME[2], FRAME[0])


def exponent(width):
    """Of the cosine about as wide."""
    return max(2 / width**2 - 2, 0)


@dataclass(frozen=True)
class Sampler:
    """lobe_sample_NAME and lobe_pdf_NAME.

    shape   the parameters for a width
    draws   "H", which mirrors V to L, or "L"
    about   local axis of the draws for a local V and the parameters
    spread  for a width, the two by which the coordinates are stretched along T and B
    """

    name: str
    shape: callable
    draws: str = "H"
    about: callable = lambda V, shape: np.array([0, 0, 1.0])
    spread: callable = lambda width: (width, width)


def lafortune_axis(V, shape):
    axis = np.asarray(shape["C"]) * V
    return axis / np.linalg.norm(axis)


SAMPLERS = [
    Sampler("GGX", lambda w: {"alpha": w}),
    Sampler("GGX_aniso", lambda w: {"alphaX": w, "alphaY": w / 4}, spread=lambda w: (w, w / 4)),
    Sampler("Beckmann", lambda w: {"alpha": w}),
    Sampler("BlinnPhong", lambda w: {"exponent": exponent(w)}),
    Sampler("Ward", lambda w: {"alphaX": w / 4, "alphaY": w}, spread=lambda w: (w / 4, w)),
    Sampler("AshikhminShirley", lambda w: {"nu": exponent(w), "nv": exponent(w / 2)}, spread=lambda w: (w, w / 2)),
    Sampler("Schlick", lambda w: {"r": w * w, "p": 0.5}),
    Sampler("Lambert", lambda w: {}, "L", spread=lambda w: (1, 1)),
    Sampler("EON", lambda w: {"roughness": w}, "L", spread=lambda w: (1, 1)),
    Sampler("Phong", lambda w: {"exponent": exponent(w)}, "L", lambda V, shape: V * (-1, -1, 1)),
    Sampler("Lafortune", lambda w: {"exponent": exponent(w), "C": (-0.7, 0.9, 0.8)}, "L", lafortune_axis),
]


def gauss(high, count):
    """Nodes and weights on 0..high, SUBDIVISION in each of `count` bins."""
    x, w = np.polynomial.legendre.leggauss(SUBDIVISION)
    bin_of = np.repeat(np.arange(count), SUBDIVISION)
    return (bin_of + np.tile((1 + x) / 2, count)) * high / count, np.tile(w, count) * high / count / 2


def frame_about(axis):
    """Rows: two axes across, which are T's and B's where the axis is the normal, and the axis."""
    across = np.cross((0, 1, 0), axis)
    across /= np.linalg.norm(across)
    return np.array([across, np.cross(axis, across), axis])


def directions(x, phi, spread):
    """Unit vectors about z at the stretched angle x in 0..pi from it, where tan(x) is the length of the stretched slope,
    and the solid angle per dx dphi."""
    a, b = spread
    D = np.column_stack([a * np.sin(x) * np.cos(phi), b * np.sin(x) * np.sin(phi), np.cos(x)])
    length = np.linalg.norm(D, axis=1)
    return D / length[:, None], a * b * np.sin(x) / length**3


def coordinates(D, spread):
    s = D / (*spread, 1)
    return np.arctan2(np.hypot(s[:, 0], s[:, 1]), s[:, 2]), np.arctan2(s[:, 1], s[:, 0]) % (2 * math.pi)


def arguments(function, count, **values):
    """name -> [count, width], of the parameters that the function has."""
    return {p: np.broadcast_to(np.asarray(values[p], np.float32).reshape(-1, w), (count, w))
            for p, w in function}


def signature(name):
    f = FUNCTIONS[name]
    return f.key, [(p.name, 1 if p.type == "float" else int(p.type[3])) for p in f.parameters]


def by_reference(prefix, sampler, count, **values):
    return referred(f"lobe_{prefix}_{sampler.name}", count, **values)


def referred(name, count, **values):
    key, parameters = signature(name)
    return reference.evaluate(key, np.hstack([*arguments(parameters, count, **values).values()]).astype(float))


def by_shader(prefix, sampler, count, **values):
    f = IN_GLSL[f"lobe_{prefix}_{sampler.name}"]
    inputs = {name: np.ascontiguousarray(x)[None]
              for name, x in arguments(signature(f.name)[1], count, **values).items()}
    with context() as current:
        return gl.evaluate(current, LIBRARY.text, f.call, f.result, inputs).astype(float)


@cache
def context():
    return gl.create_context("egl")


def shares(sampler, V, shape, spread, bins):
    """The part of the draws in each bin; 0 in those that hold an edge, where facets begin to face away from V."""
    top = math.pi / 2 if sampler.draws == "H" else math.pi
    (x, w_x), (phi, w_phi) = gauss(top, bins[0]), gauss(2 * math.pi, bins[1])
    x, phi = (a.ravel() for a in np.meshgrid(x, phi, indexing="ij"))
    D, solid_angle = directions(x, phi, spread)
    D = D @ frame_about(sampler.about(V, shape))
    mirrored = sampler.draws == "H"
    VdotH = D @ V
    L = 2 * VdotH[:, None] * D - V if mirrored else D
    jacobian = np.where(VdotH > 0, 4 * VdotH, 0) if mirrored else 1
    pdf = by_reference("pdf", sampler, len(L), N=FRAME[2], T=FRAME[0], V=V @ FRAME, L=L @ FRAME, **shape)[:, 0]
    part = pdf * jacobian * solid_angle * np.outer(w_x, w_phi).ravel()
    by_bin = lambda values: values.reshape(bins[0], SUBDIVISION, bins[1], SUBDIVISION)
    faces_V = by_bin(VdotH > 0)
    is_cut = mirrored & faces_V.any((1, 3)) & ~faces_V.all((1, 3))
    return np.where(is_cut, 0, by_bin(part).sum((1, 3))).ravel()


def check(sampler, width, degrees, count, bins, draw):
    tilt, top = math.radians(degrees), math.pi / 2 if sampler.draws == "H" else math.pi
    V = np.array([math.sin(tilt) * math.cos(0.4), math.sin(tilt) * math.sin(0.4), math.cos(tilt)])
    u = np.random.default_rng(SEED).random((count, 2), np.float32)
    shape, spread = sampler.shape(width), sampler.spread(width)
    drawn = draw("sample", sampler, count, N=FRAME[2], T=FRAME[0], V=V @ FRAME, u=u, **shape) @ FRAME.T
    assert np.linalg.norm(drawn, axis=1) == pytest.approx(1, rel=2e-6)
    if sampler.draws == "H":
        assert (drawn[:, 2] >= -1e-6).all()
        drawn = drawn[drawn @ V > 0]  # a facet that faces away mirrors nothing

    x, phi = coordinates(drawn @ frame_about(sampler.about(V, shape)).T, spread)
    observed = np.histogram2d(x, phi, bins, [(0, top), (0, 2 * math.pi)])[0].ravel()
    expected = shares(sampler, V, shape, spread, bins) * count
    assert expected.sum() <= count * (1 + 1e-3)
    rare = expected < 5
    pool = lambda counts: np.append(counts[~rare], count - counts[~rare].sum())  # with what has no bin
    observed, expected = pool(observed), pool(expected)
    if expected[-1] < 5:
        observed, expected = observed[:-1], expected[:-1] * observed[:-1].sum() / expected[:-1].sum()
    chi2 = ((observed - expected) ** 2 / expected).sum()
    p = stats.chi2.sf(chi2, len(expected) - 1)
    # Sidak: the significance holds for all widths and views of a sampler together
    assert p > 1 - (1 - SIGNIFICANCE) ** (1 / (len(WIDTHS) * len(VIEWS))), \
        f"chi2 {chi2:.1f} of {len(expected)} bins, seed {SEED}"


def cases(widths, views):
    """Every sampler's draws by the reference, and by the shader where there is one."""
    return pytest.mark.parametrize("sampler, draw, width, degrees", [
        pytest.param(s, draw, w, v, id=f"{s.name}-{draw.__name__}-{w}-{v}") for s in SAMPLERS
        for draw in (by_reference, by_shader) if draw is by_reference or f"lobe_sample_{s.name}" in IN_GLSL
        for w in widths for v in views])


@cases((0.02, 0.5), (45, 89))
def test_draws_follow_the_density(sampler, draw, width, degrees):
    check(sampler, width, degrees, 50_000, (16, 32), draw)


@pytest.mark.full
@cases(WIDTHS, VIEWS)
def test_many_draws_follow_the_density(sampler, draw, width, degrees):
    count, bins = (1_000_000, (48, 96)) if draw is by_shader else (100_000, (16, 32))
    check(sampler, width, degrees, count, bins, draw)


def test_every_sampler_is_tested():
    drawn = {f.name[len("lobe_sample_"):] for f in reference.functions() if f.name.startswith("lobe_sample_")}
    assert drawn == {s.name for s in SAMPLERS}


MIXTURES = {  # lobe: its parameters, and the sampler that ashikhmin_shirley.glsl and schlick.glsl mix with Lambert's
    "lobe_AshikhminShirley": ({"rd": [0.5] * 3, "rs": [0.1] * 3, "nu": 20, "nv": 200}, "AshikhminShirley",
                              {"nu": 20, "nv": 200}),
    "lobe_Schlick": ({"f0": [0.1] * 3, "r": 0.1, "p": 0.5}, "Schlick", {"r": 0.1, "p": 0.5}),
}


@pytest.mark.parametrize("name", MIXTURES)
def test_draws_from_a_sum_need_no_more_than_two_densities(name):
    """As the headers tell: either of two samplers by chance, weighed with both densities, gives the whole lobe's albedo."""
    settings, highlight, shape = MIXTURES[name]
    rng, count, chance = np.random.default_rng(SEED), 100_000, 0.4
    T, B, N = FRAME
    V = np.array([0.6, 0.1, 0.63**0.5]) @ FRAME
    u = rng.random((count, 2))
    H = referred(f"lobe_sample_{highlight}", count, N=N, T=T, u=u, **shape)
    mirrored, diffuse = 2 * (H @ V)[:, None] * H - V, referred("lobe_sample_Lambert", count, N=N, T=T, u=u)
    L = np.where(rng.random((count, 1)) < chance, mirrored, diffuse)
    density = (1 - chance) * referred("lobe_pdf_Lambert", count, N=N, L=L) \
        + chance * referred(f"lobe_pdf_{highlight}", count, N=N, T=T, V=V, L=L, **shape)
    f = referred(name, count, N=N, T=T, V=V, L=L, **settings)[:, :1]
    weight = f * (L @ N)[:, None] / np.maximum(density, 1e-30)  # below the horizon both are 0

    (z, w_z), (phi, w_phi) = gauss(1, 60), gauss(2 * math.pi, 60)
    z, phi = (a.ravel()[:, None] for a in np.meshgrid(z, phi, indexing="ij"))
    grid = (np.sqrt(1 - z * z) * np.concatenate([np.cos(phi), np.sin(phi)], 1)) @ FRAME[:2] + z * N
    f = referred(name, len(grid), N=N, T=T, V=V, L=grid, **settings)[:, :1]
    albedo = (f * z * np.outer(w_z, w_phi).reshape(-1, 1)).sum()
    assert abs(weight.mean() - albedo) < 4 * weight.std() / math.sqrt(count), f"seed {SEED}"
    assert weight.std() < albedo
