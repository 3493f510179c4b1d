"""Simulated measurements, to fit models to, in NumPy: metals by wave optics, and facets of a distribution that no model
of the library has. V, L [n, 3] above the horizon, N along z; f [n, channels] in 1/sr.
"""

from __future__ import annotations

import numpy as np

from . import he_torrance, spectra
from .metals import fresnel
from .paths import DATA

CHANNELS_NM = (610, 550, 465)  # wavelengths that stand for red, green, blue
ALUMINIUM = {"nm": 500, "sigma0": 0.28, "tau": 1.77}  # um; often quoted for the roughened aluminium of He et al. 1991
GOLD = {"sigma0": 0.18, "tau": 3.0}
PLASTIC = {"alpha": 0.2, "n": 1.5, "albedo": (0.08, 0.2, 0.45)}
COPPER = {"alpha": 0.3}


def index(element: str, nm: int) -> complex:
    """Measured n + ik."""
    n, k = spectra.sampled(DATA / "ior" / f"{element}.csv")
    return complex(n[nm - 380], k[nm - 380])


def alpha(surface: dict) -> float:
    """The width of the facets that waves scatter like in the limit of great roughness."""
    return 2 * surface["sigma0"] / surface["tau"]


def aluminium(V: np.ndarray, L: np.ndarray) -> np.ndarray:
    """He and Torrance's, at one wavelength."""
    nm, sigma0, tau = ALUMINIUM.values()
    return he_torrance.reflectance(V, L, index("Al_McPeak", nm), sigma0, tau, nm / 1000)[:, None]


def gold(V: np.ndarray, L: np.ndarray) -> np.ndarray:
    """He and Torrance's, smoother, in three channels. Its mirror part, which grows at grazing, is no reflectance."""
    return np.stack([he_torrance.reflectance(V, L, index("Au_Johnson", nm), *GOLD.values(), nm / 1000)
                     for nm in CHANNELS_NM], axis=1)


def plastic(V: np.ndarray, L: np.ndarray) -> np.ndarray:
    """Student's facets of glass over Lambert."""
    F = fresnel(np.linalg.norm(V + L, axis=1) / 2, PLASTIC["n"] + 0j)
    return (student_facets(V, L, PLASTIC["alpha"]) * F)[:, None] + np.array(PLASTIC["albedo"]) / np.pi


def copper(V: np.ndarray, L: np.ndarray) -> np.ndarray:
    """Student's facets of metal."""
    cosine, facets = np.linalg.norm(V + L, axis=1) / 2, student_facets(V, L, COPPER["alpha"])
    return np.stack([facets * fresnel(cosine, index("Cu_Johnson", nm)) for nm in CHANNELS_NM], axis=1)


def student_facets(V: np.ndarray, L: np.ndarray, alpha: float) -> np.ndarray:
    """D G2 / (4 NdotV NdotL) [n], height-correlated Smith."""
    H = (V + L) / np.linalg.norm(V + L, axis=1, keepdims=True)
    hidden = student_lambda(V[:, 2], alpha) + student_lambda(L[:, 2], alpha)
    return student_D(H[:, 2], alpha) / (1 + hidden) / (4 * V[:, 2] * L[:, 2])


def student_D(NdotH: np.ndarray, alpha: float) -> np.ndarray:
    """Facets whose slopes are Student's with exponent 3 (Ribardiere et al. 2017), between GGX, 2, and Beckmann,
    infinite; slopes p have the density (1 + p^2 / (2 alpha^2))^-3 / (pi alpha^2)."""
    NdotH = np.maximum(NdotH, 1e-6)
    tan2 = (1 - NdotH**2) / NdotH**2
    return (1 + tan2 / (2 * alpha**2)) ** -3 / (np.pi * alpha**2 * NdotH**4)


def student_lambda(cosine: np.ndarray, alpha: float) -> np.ndarray:
    """Smith's: the integral of (q - cot) P(q) over slopes q above cot, over cot, of their marginal density
    P(q) = 3 sqrt(2) / (8 alpha) (1 + q^2 / (2 alpha^2))^(-5/2)."""
    cot, width = cosine / np.sqrt(np.maximum(1 - cosine**2, 1e-30)), np.sqrt(2) * alpha
    t = cot / width
    root = np.sqrt(1 + t * t)
    steeper = 2 / 3 - t / (3 * root**3) - 2 * t / (3 * root)
    return 3 / (4 * width) * (width**2 / (3 * root**3) - cot * width * steeper) / cot
