"""He, Torrance, Sillion, Greenberg 1991, in NumPy: a rough conductor by wave optics, for simulated measurements.

The directional-diffuse part for unpolarised light. The mirror part, of weight exp(-g), is no reflectance: where the
surface is rough (g > 10) it is gone. Lengths and wavelength in one unit; N is along z.
"""

from __future__ import annotations

import numpy as np
from scipy.special import erfc, gammaln, lambertw

from .metals import fresnel


def reflectance(V: np.ndarray, L: np.ndarray, index: complex | None, sigma0: float, tau: float,
                wavelength: float) -> np.ndarray:
    """f [n] in 1/sr between directions [n, 3] above the horizon.

    index   n + ik of the metal; None for a perfect mirror
    sigma0  rms height; tau  its correlation length
    """
    NdotV, NdotL, H = V[:, 2], L[:, 2], V + L
    LdotH = np.linalg.norm(H, axis=1) / 2
    F = 1.0 if index is None else fresnel(LdotH, index)
    geometric = ((H**2).sum(1) / H[:, 2]) ** 2  # eq. 76, whose polarisations' products are all in it
    seen = shadowing(NdotV, sigma0, tau) * shadowing(NdotL, sigma0, tau)
    g = apparent_roughness(NdotV, NdotL, sigma0, tau, wavelength)
    lateral = (np.pi * tau / wavelength) ** 2 * (H[:, 0] ** 2 + H[:, 1] ** 2)
    D = (np.pi * tau / (2 * wavelength)) ** 2 * scattered(g, lateral)
    return F * geometric * seen * D / (np.pi * NdotV * NdotL)


def apparent_roughness(NdotV, NdotL, sigma0: float, tau: float, wavelength: float) -> np.ndarray:
    """g, eq. 79 to 83: the phase variance of what is not shadowed."""
    K = sum(np.sqrt(1 - c * c) / c * erfc(tau / (2 * sigma0) * c / np.sqrt(np.maximum(1 - c * c, 1e-300)))
            for c in (NdotV, NdotL))
    x2 = lambertw(K * K / (8 * np.pi)).real  # (z0 / sigma0)^2, since x exp(x^2 / 2) = K / sqrt(8 pi)
    return (2 * np.pi * sigma0 / wavelength * (NdotV + NdotL)) ** 2 / (1 + x2)


def shadowing(cosine: np.ndarray, sigma0: float, tau: float) -> np.ndarray:
    """Smith 1967, eq. 24 and 25, the latter with the exponential that its print lacks."""
    u = tau / (2 * sigma0) * cosine / np.sqrt(np.maximum(1 - cosine**2, 1e-300))
    with np.errstate(over="ignore", under="ignore"):
        hidden = (np.exp(-u * u) / (np.sqrt(np.pi) * u) - erfc(u)) / 2
    return (1 - erfc(u) / 2) / (1 + hidden)


def scattered(g: np.ndarray, lateral: np.ndarray) -> np.ndarray:
    """The sum of eq. 78 over m of g^m exp(-g) / (m! m) exp(-lateral / m), term by term in logarithms."""
    last = int(np.max(g + 10 * np.sqrt(g) + 3 * np.sqrt(lateral))) + 40
    total = np.zeros_like(g)
    for m in range(1, last):
        total += np.exp(m * np.log(g) - g - gammaln(m + 1) - np.log(m) - lateral / m)
    return total
