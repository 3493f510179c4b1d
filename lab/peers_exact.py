"""Exact values of what peers compute and we have no function of: double precision, each from its paper.

Each takes inputs by our parameter names, arrays [..., n, width], and returns [..., n, channels].
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from lobe import reference

from . import catalogue, compare, geometry


def _column(x, *names):
    return (x[n].astype(np.float64) for n in names)


def burley(x):
    """Burley 2012, section 5.3."""
    N, V, L, albedo, roughness = _column(x, "N", "V", "L", "albedo", "roughness")
    c = (geometry.dot(N, V), geometry.dot(N, L))
    f90 = 0.5 + 2 * roughness * geometry.dot(L, geometry.halfway(V, L)) ** 2
    f = albedo / np.pi * np.prod([1 + (f90 - 1) * (1 - np.clip(u, 0, 1)) ** 5 for u in c], axis=0)
    return np.where(np.minimum(*c) > 0, f, 0.0)


def schlick_exp2(x):
    """Lagarde 2012."""
    c, f0 = _column(x, "cosI", "f0")
    return f0 + (1 - f0) * 2 ** ((-5.55473 * c - 6.98316) * c)


def gaussian(x):
    """Torrance, Sparrow 1967: exp(-(theta / width)^2), width^2 = 2 / exponent."""
    c, exponent = _column(x, "NdotH", "exponent")
    return np.exp(-0.5 * exponent * np.arccos(np.clip(c, -1, 1)) ** 2)


def power(x):
    """NdotH^exponent, or by our members' names s^exponent and s^h."""
    (c,), (exponent,) = (_column(x, *(n for n in names if n in x)) for names in (("NdotH", "s"), ("exponent", "h")))
    return c**exponent


def power_schlick(x):
    """Schlick 1994, eq. 17."""
    c, exponent = _column(x, "NdotH", "exponent")
    return c / (exponent - (exponent - 1) * c)


def implicit_blinn_phong(x):
    """D F / 4, F by exp2."""
    N, V, L, rs, exponent = _column(x, "N", "V", "L", "rs", "exponent")
    H = geometry.halfway(V, L)
    c = np.clip(geometry.dot(N, H), 0, 1)
    F = schlick_exp2({"cosI": geometry.dot(V, H), "f0": rs})
    inside = np.minimum(geometry.dot(N, V), geometry.dot(N, L)) > 0
    return np.where(inside, F * (exponent + 2) / (8 * np.pi) * c**exponent, 0.0)


def implicit(x):
    """Masking that cancels the foreshortening."""
    return np.full_like(x["NdotV"], 0.25, dtype=np.float64)


def capped(name: str, most: float) -> Callable:
    """Our reference of that name or key, not above a number: what half precision holds."""
    return lambda x: np.minimum(evaluated(name, x), most)


def compensated_ggx(x):
    """lobe_GGX times 1 + F (1 - E) / E, E its exact albedo for F = 1 (Turquin 2019)."""
    N, V, L, f0, alpha = _column(x, "N", "V", "L", "f0", "alpha")
    E = evaluated("lobe_albedo_GGX", {"NdotV": np.clip(geometry.dot(N, V), 1e-6, 1), "alpha": alpha})
    F = _schlick(geometry.dot(L, geometry.halfway(V, L)), f0)
    return evaluated("lobe_GGX", x) * (1 + F * (1 - E) / E)


def ggx_with(factor: Callable) -> Callable:
    """lobe_GGX with another term in it: `factor` takes its NdotV, NdotL, LdotH, f0 and alpha."""
    def exact(x):
        N, V, L, f0, alpha = _column(x, "N", "V", "L", "f0", "alpha")
        v, l = (np.clip(geometry.dot(N, w), 1e-12, 1) for w in (V, L))
        return evaluated("lobe_GGX", x) * factor(v, l, geometry.dot(L, geometry.halfway(V, L)), f0, alpha)

    return exact


def exp2_over_schlick(v, l, u, f0, alpha):
    return schlick_exp2({"cosI": u, "f0": f0}) / _schlick(u, f0)


def fast_over_smith(v, l, u, f0, alpha):
    x = {"NdotV": v, "NdotL": l, "alpha": alpha}
    return evaluated("lobe_V_GGX_fast", x) / evaluated("lobe_V_GGX", x)


def capped_over_smith(v, l, u, f0, alpha):
    V = evaluated("lobe_V_GGX", {"NdotV": v, "NdotL": l, "alpha": alpha})
    return np.minimum(V, 65504) / V


def _schlick(c, f0):
    return f0 + (1 - f0) * (1 - np.clip(c, 0, 1)) ** 5


def evaluated(name: str, x: dict[str, np.ndarray]) -> np.ndarray:
    """Our reference's values of the one function of that name or key."""
    (function,) = catalogue.load().find(name)
    packed = compare.rows(function, x)
    return reference.evaluate(function.key, packed).reshape(*next(iter(x.values())).shape[:-1], -1)
