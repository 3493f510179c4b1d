"""Adversarial inputs for any function of the library, formed from the names and types of its parameters.

Every number is exactly a binary32 value, as the shaders see it, kept in float64. A good part of the draws of each
parameter lies at logarithmic distances from its singular values: a cosine of 1e-6 is then as likely as one of 0.1.
"""
import math
import random

import numpy as np

from lobe.lab import catalogue

DIRECTIONS = tuple(f.name for f in catalogue.load().functions if f.returns_directions)  # their result has either sign


QUARTERS = (0.25, 0.5, 0.75)
COSINE_SPECIALS = (0.0, 1.0, 0.5)
ETA_SPECIALS = (1.0, 1.5, 1 / 1.5, 1.0003, 2.42, 0.04, 25.0)
ALPHA_SPECIALS = (0.0, 1e-5, 1e-4, 1.0, 4.0)
K_SPECIALS = (0.0, 1e-20, 1e-4, 3.6, 90.0)
EXPONENT_SPECIALS = (0.0, 1.0, 50.0, 1e6)
COLOR_SPECIALS = (0.0, 1.0, 0.04, 1.022, 1 - 2.0**-24)


def log_uniform(rng, low, high):
    return math.exp(rng.uniform(math.log(low), math.log(high)))


def cosine(rng):
    return rng.choice((
        lambda: rng.random(),
        lambda: log_uniform(rng, 1e-6, 1),
        lambda: 1 - log_uniform(rng, 2**-24, 1),
        lambda: rng.choice(COSINE_SPECIALS),
    ))()


def eta(rng):
    return rng.choice((
        lambda: log_uniform(rng, 0.3, 3),
        lambda: 1 + rng.choice((-1, 1)) * log_uniform(rng, 2**-22, 0.5),
        lambda: rng.choice(ETA_SPECIALS),
    ))()


def alpha(rng):
    return rng.choice(ALPHA_SPECIALS) if rng.random() < 0.1 else log_uniform(rng, 1e-4, 4)


def color(rng):
    return rng.choice((
        lambda: rng.random(),
        lambda: log_uniform(rng, 1e-6, 1),
        lambda: 1 - log_uniform(rng, 2**-24, 1),
        lambda: rng.choice(COLOR_SPECIALS),
    ))()


def sigma(rng):
    return 0.0 if rng.random() < 0.05 else log_uniform(rng, 1e-3, math.pi / 2)


def k(rng):
    return rng.choice(K_SPECIALS) if rng.random() < 0.2 else log_uniform(rng, 1e-4, 10)


def exponent(rng):
    return rng.choice(EXPONENT_SPECIALS) if rng.random() < 0.2 else log_uniform(rng, 1e-2, 1e6)


def slope(rng):
    """A component of a normal's derivative."""
    return rng.choice((-1, 1)) * log_uniform(rng, 1e-5, 1)


def uniform(rng):
    """A random number as a sampler receives it: below 1. Of a turn, quarters are critical."""
    return min(1 - 2.0**-24, rng.choice((
        lambda: cosine(rng),
        lambda: rng.choice(QUARTERS) + rng.choice((-1, 1)) * log_uniform(rng, 2**-24, 0.25),
        lambda: rng.choice(QUARTERS),
    ))())


def coefficient(rng):
    """A component of what scales V into the axis of a generalised cosine lobe, or of a direction."""
    size = 0.0 if rng.random() < 0.05 else rng.choice((rng.uniform(0, 1.2), log_uniform(rng, 1e-6, 1)))
    return rng.choice((-1, 1)) * size


ALPHAS, EXPONENTS = ("alpha", "alphaX", "alphaY", "alphas"), ("exponent", "nu", "nv", "h")
KINDS = {"eta": eta, "eta0": eta, "k": k, "sigma": sigma, "u": uniform, "dNdx": slope, "dNdy": slope,
         **dict.fromkeys(ALPHAS, alpha), **dict.fromkeys((*EXPONENTS, "exponent1", "exponent2", "exponent3"), exponent),
         **{f"C{axis}{lobe}": coefficient for axis in ("", *"xyz") for lobe in ("", *"123")},
         "lLocal": coefficient, "vLocal": coefficient}


def scalar(rng, name):
    if "dot" in name or name == "cosI":
        return cosine(rng)
    return KINDS.get(name, color)(rng)


def width(values):
    """About the angle that the lobe spans."""
    alphas = [np.min(values[name]) for name in ALPHAS if name in values]
    alphas += [math.sqrt(2 / (np.max(values[name]) + 2)) for name in EXPONENTS if name in values]
    return max(min(alphas, default=0.5), 1e-4)


def near_critical_angle(rng, eta):
    return min(math.sqrt((1 - eta) * (1 + eta)) * (1 + rng.choice((-1, 1)) * log_uniform(rng, 1e-7, 0.1)), 1)


def random_unit(rng):
    v = np.array([rng.gauss(0, 1) for _ in range(3)])
    return v / np.linalg.norm(v)


def tilted(rng, axis, angle):
    """The unit vector at `angle` from the unit vector `axis`, in a random azimuth."""
    side = np.cross(axis, random_unit(rng))
    return axis * math.cos(angle) + side / np.linalg.norm(side) * math.sin(angle)


def mirrored(axis, v):
    return 2 * np.dot(axis, v) * axis - v


def directions(rng, width):
    """N, T, V, L and an H of any length; `width` is the angle, about the lobe's, at which H stands off N."""
    N = np.array([0.0, 0.0, 1.0]) if rng.random() < 0.1 else random_unit(rng)
    off = min(width * log_uniform(rng, 1e-2, 1e2), 1.5)
    V = tilted(rng, N, math.acos(cosine(rng)))
    L = rng.choice((
        lambda: tilted(rng, N, math.acos(cosine(rng))),
        lambda: mirrored(tilted(rng, N, off), V),  # H within the highlight
        lambda: -tilted(rng, V, log_uniform(rng, 1e-6, 1)),  # the half vector vanishes
        lambda: V,
        lambda: N,
    ))()
    if rng.random() < 0.05:
        V = N
    H = tilted(rng, N, off) * log_uniform(rng, 1e-3, 1e3)
    if rng.random() < 0.05:
        H = N * rng.choice((0, 2))
    return {"N": N, "T": tilted(rng, N, math.pi / 2), "V": V, "L": L, "H": H}


def components(rng, names, width):
    """The cosines with N, T and B of each direction that has all three, so that they are of one unit vector."""
    values = {}
    for X in (x for x in "VLH" if f"Tdot{x}" in names):
        polar = min(width * log_uniform(rng, 1e-2, 1e2), 1.5) if X == "H" else math.acos(cosine(rng))
        azimuth = rng.uniform(0, 2 * math.pi)
        values[f"Ndot{X}"] = math.cos(polar)
        values[f"Tdot{X}"] = math.sin(polar) * math.cos(azimuth)
        values[f"Bdot{X}"] = math.sin(polar) * math.sin(azimuth)
    return values


def draw(rng, function):
    names = [p.name for p in function.parameters]
    values = {p.name: scalar(rng, p.name) if p.type == "float" else [scalar(rng, p.name) for _ in range(int(p.type[3]))]
              for p in function.parameters}
    vectors = directions(rng, width(values))
    eta = values.get("eta", 1)
    if isinstance(eta, float) and eta < 1 and rng.random() < 0.5:  # total internal reflection begins
        values["cosI"] = near_critical_angle(rng, eta)
        vectors["V"] = tilted(rng, vectors["N"], math.acos(values["cosI"]))
        values["k"] = 0.0
    values.update(components(rng, names, width(values)))
    values.update({name: v for name, v in vectors.items() if name in names})
    return np.concatenate([np.atleast_1d(values[name]) for name in names])


def adversarial_rows(function, count, seed):
    """(count, argument width) packed arguments for `function`; the same for the same seed."""
    rng = random.Random(f"{seed} {function.key}")
    return np.array([draw(rng, function) for _ in range(count)]).astype(np.float32).astype(np.float64)
