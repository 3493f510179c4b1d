"""The fits of glsl/: each function here reproduces the coefficients that stand in the file that it names.

`python -m lobe.lab.fits` prints all of them, each with its largest error. Functions of one variable, to be exact to
float32, are fitted by levelled least squares; those of two, to be exact to a thousandth, by linear programming.
"""

from __future__ import annotations

import numpy as np
from scipy.optimize import linprog
from scipy.special import erf

ALPHAS = np.unique(np.concatenate([np.geomspace(0.01, 1, 17), np.linspace(0.1, 1, 10)]))
COSINES = np.unique(np.concatenate([[1e-6, 1e-4, 3e-4], np.geomspace(1e-3, 1, 28), np.linspace(0.05, 1, 20)]))


def levelled(numerator: np.ndarray, denominator: np.ndarray, f: np.ndarray, weight: np.ndarray, rounds: int = 300):
    """p, q, error of f = numerator p / (1 + denominator q) with the smallest max of weight |error|.

    Sanathanan and Koerner's iteration makes the fit linear, Lawson's weights level its error.

    numerator, denominator   [points, terms], the terms of both polynomials at each point
    """
    lawson, scale, best = np.ones(len(f)), np.ones(len(f)), (None, None, np.inf)
    for _ in range(rounds):
        row_weight = weight * np.sqrt(lawson) / scale
        rows = np.hstack([numerator, -f[:, None] * denominator]) * row_weight[:, None]
        size = np.linalg.norm(rows, axis=0)
        c = np.linalg.lstsq(rows / size, f * row_weight, rcond=None)[0] / size
        p, q = np.split(c, [numerator.shape[1]])
        scale = 1 + denominator @ q
        error = weight * np.abs(numerator @ p / scale - f)
        if scale.min() > 0 and error.max() < best[2]:
            best = p, q, error.max()
        lawson *= error / error.max() + 1e-3
        lawson /= lawson.max()
    return best


def programmed(numerator: np.ndarray, denominator: np.ndarray, f: np.ndarray, weight: np.ndarray, rounds: int = 25):
    """The same by the differential correction algorithm: slower, sure to converge, the denominator at least 0.02."""
    n, m = numerator.shape[1], denominator.shape[1]
    size = np.abs(np.hstack([numerator, denominator])).max(0)
    N, D = numerator / size[:n], denominator / size[n:]
    c = np.append(np.linalg.lstsq(N, f, rcond=None)[0], np.zeros(m))
    Q, bound = np.ones(len(f)), (weight * np.abs(N @ c[:n] - f)).max()
    best = c / size, bound
    for _ in range(rounds):
        above, below = f - bound / weight, f + bound / weight
        slack = -(Q / weight)[:, None]
        limits = np.vstack([np.hstack([-N, above[:, None] * D, slack]), np.hstack([N, -below[:, None] * D, slack]),
                            np.hstack([0 * N, -D, 0 * slack])])
        found = linprog(np.eye(1, n + m + 1, n + m)[0], limits, np.concatenate([-above, below, np.full(len(f), 0.98)]),
                        bounds=[(-1e3, 1e3)] * (n + m) + [(None, None)])
        if found.x is None:
            break
        c = found.x[:-1]
        Q = 1 + D @ c[n:]
        error = (weight * np.abs(N @ c[:n] / Q - f)).max()
        if error < best[1]:
            best = c / size, error
        if error > 0.999 * bound:
            break
        bound = error
    return best[0][:n], best[0][n:], best[1]


def powers(x: np.ndarray, degree: int, lowest: int = 0) -> np.ndarray:
    """[points, terms]: x^lowest .. x^degree."""
    return x[:, None] ** np.arange(lowest, degree + 1)


def triangle(x: np.ndarray, y: np.ndarray, degree: int) -> np.ndarray:
    """[points, terms]: x^i y^j with i + j <= degree, by i, then by j."""
    return np.stack([x**i * y**j for i in range(degree + 1) for j in range(degree + 1 - i)], -1)


def between(low: float, high: float, count: int = 1500) -> np.ndarray:
    """Chebyshev's points."""
    return low + (high - low) * (1 - np.cos(np.pi * (np.arange(count) + 0.5) / count)) / 2


def circle():
    """core.glsl, lobe_circle: sin(2 pi x) / x - 4 over y = 1/16 - x^2; 1..4. The error is that of the sine, relative."""
    y = between(0, 1 / 16)
    x = np.sqrt(1 / 16 - y)
    f = np.sin(2 * np.pi * x) / x
    return levelled(powers(y, 4, 1), np.zeros((len(y), 0)), f - 4, 1 / f)


def G1_beckmann():
    """beckmann.glsl, lobe_G1_Beckmann: G1 / v over v; p 0..5, q 1..6."""
    v = between(0, 3.4)
    f = 2 / (v * (1 + erf(v)) + np.exp(-v * v) / np.sqrt(np.pi))
    return levelled(powers(v, 5), powers(v, 6, 1), f, 1 / f)


def loss_EON():
    """oren_nayar.glsl, lobe_loss_EON: loss / c; p 0..4, then q 0..4, which s multiplies."""
    c = between(0, 1)
    f = _loss(c) / c
    terms = np.hstack([powers(c, 4), np.sqrt(1 - c * c)[:, None] * powers(c, 4)])
    return levelled(terms, np.zeros((len(c), 0)), f, 1 / f)


def loss_EON_fast():
    """oren_nayar.glsl, lobe_loss_EON_fast: loss / c; 0..3. The error is that of the loss."""
    c = between(0, 1)
    return levelled(powers(c, 3), np.zeros((len(c), 0)), _loss(c) / c, c)


def _loss(c: np.ndarray) -> np.ndarray:
    s = np.sqrt(1 - c * c)
    start = (np.pi / 2 - 2 / 3) * c * c / (1 + s) + s * np.arcsin(c) + s * s * c
    return (start - 2 / 3 * s * c * (1 + s + s * s) / (1 + s)) / np.pi


def oren_nayar_angle():
    """oren_nayar.glsl, lobe_OrenNayar: asin(c) / (c pi/2); 0..4, then 0..3, which sqrt(1 - c) multiplies."""
    c = between(0, 1)
    f = np.arcsin(c) / c * 2 / np.pi
    terms = np.hstack([powers(c, 4), np.sqrt(1 - c)[:, None] * powers(c, 3)])
    return levelled(terms, np.zeros((len(c), 0)), f, 1 / f)


def angle():
    """core.glsl, lobe_angle_of_half: angle / tan(angle / 2) over tan^2(angle / 2); 0..9."""
    w2 = between(0, 1)
    f = 2 * np.arctan(np.sqrt(w2)) / np.sqrt(w2)
    return levelled(powers(w2, 9), np.zeros((len(w2), 0)), f, 1 / f)


def norm_gaussian():
    """gaussian.glsl, lobe_peak_Gaussian: the inverse over pi alpha^2, over x = alpha^2; p 0..5, q 1..6."""
    alpha = np.concatenate([[1e-3], between(0.01, 4, 600)])
    node, weight = np.polynomial.legendre.leggauss(200)
    end = np.minimum(np.pi / 2, 9 * alpha)[:, None]
    d = end * (node + 1) / 2
    f = (end * weight / 2 * np.exp(-((d / alpha[:, None]) ** 2)) * np.sin(2 * d)).sum(1) / alpha**2
    x = alpha**2
    return levelled(powers(x, 5), powers(x, 6, 1), f, 1 / f)


def artanh_rest():
    """schlick.glsl, lobe_D_SchlickPower: (artanh(z) - z) / z^3 over z^2, z to 1/2; 0..6."""
    z2 = between(0, 0.25)
    f = sum(z2**k / (2 * k + 3) for k in range(40))
    return levelled(powers(z2, 6), np.zeros((len(z2), 0)), f, 1 / f)


def ggx_albedo(NdotV: np.ndarray, alpha: np.ndarray, count: int = 160) -> tuple[np.ndarray, np.ndarray]:
    """Directional albedo of GGX (F = 1, height-correlated Smith), and its part that is weighted with (1 - L.H)^5.

    Quadrature over the visible normals (Dupuy, Benyoub 2023), where the integrand is G2 / G1. Arrays of one shape.
    """
    u, w = np.polynomial.legendre.leggauss(count)
    u, w = (u * (3 - u * u) / 2 + 1) / 2, w * 0.75 * (1 - u * u)  # denser at both ends
    phi = 2 * np.pi * (np.arange(count) + 0.5) / count
    result = np.zeros((2, *NdotV.shape))
    for i in np.ndindex(NdotV.shape):
        c, a = NdotV[i], alpha[i]
        sine = np.sqrt(1 - c * c)
        vx, vz = np.array([a * sine, c]) / np.hypot(a * sine, c)
        z = (1 - u[:, None]) * (1 + vz) - vz
        s = np.sqrt(1 - np.minimum(z * z, 1))
        h = np.stack([a * (s * np.cos(phi) + vx), a * s * np.sin(phi), np.broadcast_to(z + vz, (count, count))])
        h /= np.sqrt((h * h).sum(0))
        VdotH = np.clip(h[0] * sine + h[2] * c, 0, 1)
        NdotL = np.clip(2 * VdotH * h[2] - c, 0, 1)
        gv, gl = (np.sqrt(x * x + a * a * (1 - x * x)) for x in (c, NdotL))
        weight = NdotL * (c + gv) / (NdotL * gv + c * gl)  # G2 / G1
        result[0][i] = (w @ weight).mean()
        result[1][i] = (w @ (weight * (1 - VdotH) ** 5)).mean()
    return result[0], result[1]


def _table():
    c, a = (x.ravel() for x in np.meshgrid(COSINES, ALPHAS, indexing="ij"))
    return c, a, np.sqrt(c * c + a * a * (1 - c * c)), *ggx_albedo(c, a)


def albedo_ggx():
    """energy.glsl, lobe_albedo_GGX: p and q over x = sqrt(c / g) and alpha, by powers of x, then of alpha."""
    c, a, g, albedo, _ = _table()
    x = np.sqrt(c / g)
    return programmed(triangle(x, a, 4) * (x * x)[:, None], triangle(x, a, 3)[:, 1:], 1 - albedo, np.ones(len(c)))


def albedo_avg_ggx():
    """energy.glsl, lobe_albedo_avg_GGX: (1 - mean) / alpha^2; p 0..2, q 1..3. The error is over mean + 0.03."""
    x, w = np.polynomial.legendre.leggauss(48)
    c, w = ((x + 1) / 2) ** 3, w * 1.5 * ((x + 1) / 2) ** 2  # denser near grazing
    alpha = np.geomspace(0.01, 1, 24)
    lost = (w * 2 * c) @ (1 - ggx_albedo(*np.meshgrid(c, alpha, indexing="ij"), 120)[0])
    return programmed(powers(alpha, 4, 2), powers(alpha, 3, 1), lost, 1 / (lost + 0.03), 30)


def dfg_ggx():
    """energy.glsl, lobe_DFG_GGX: w / g over c / g and sqrt(alpha), bias = albedo (1 - w)^5. The error is the bias's."""
    c, a, g, albedo, bias = _table()
    w = 1 - (bias / albedo) ** 0.2
    slope = 5 * (1 - w) ** 4 * albedo + 1e-3  # of the bias over w
    x, r = c / g, np.sqrt(a)
    return programmed(triangle(x, r, 4) * g[:, None], triangle(x, r, 3)[:, 1:], w, slope)


def dfg_ggx_fast():
    """energy.glsl, lobe_DFG_GGX_fast: w over 1, c, r, r^3, t r, c r; 1 - albedo over s a^2, t a^3, s^3, s^3 a^2, t^2."""
    c, a, _, albedo, bias = _table()
    t, r = c / (c + 0.6 * a), np.sqrt(a)
    s, none = np.sqrt(t), np.zeros((len(c), 0))
    mean = np.stack([np.ones(len(c)), c, r, r**3, t * r, c * r], -1)
    lost = np.stack([s * a**2, t * a**3, s**3, s**3 * a**2, t * t], -1)
    w = 1 - (bias / albedo) ** 0.2
    start = [levelled(mean, none, w, 5 * (1 - w) ** 4 * albedo + 1e-3)[0], levelled(lost, none, 1 - albedo, np.ones(len(c)))[0]]

    def errors(parameters: np.ndarray) -> np.ndarray:
        p, q = np.split(parameters, [mean.shape[1]])
        part, kept = np.clip(1 - mean @ p, 0, 1) ** 5, np.clip(1 - lost @ q, 0, 1)
        return np.concatenate([kept * (1 - part) - (albedo - bias), kept * part - bias])

    best, error = refined(errors, np.concatenate(start))
    return *np.split(best, [mean.shape[1]]), error


def refined(errors, x: np.ndarray, reach: float = 0.03, rounds: int = 60) -> tuple[np.ndarray, float]:
    """Parameters near x with a smaller max |errors(x)|: linear programs on the slopes, in a reach that adapts."""
    best = np.abs(errors(x)).max()
    for _ in range(rounds):
        e = errors(x)
        slopes = np.stack([(errors(x + 1e-6 * d) - e) / 1e-6 for d in np.eye(len(x))], -1)
        one = np.ones((len(e), 1))
        step = linprog(np.eye(1, len(x) + 1, len(x))[0], np.vstack([np.hstack([slopes, -one]), np.hstack([-slopes, -one])]),
                       np.concatenate([-e, e]), bounds=[(-reach, reach)] * len(x) + [(0, None)]).x
        found = np.abs(errors(x + step[:-1])).max() if step is not None else np.inf
        if found < best:
            x, best, reach = x + step[:-1], found, 2 * reach
        else:
            reach /= 3
    return x, best


if __name__ == "__main__":
    np.set_printoptions(precision=9, suppress=True, linewidth=110)
    for fit in (circle, G1_beckmann, loss_EON, loss_EON_fast, oren_nayar_angle, angle, norm_gaussian,
                artanh_rest, albedo_ggx, albedo_avg_ggx, dfg_ggx, dfg_ggx_fast):
        p, q, error = fit()
        print(f"{fit.__doc__.splitlines()[0]}\n  error {error:.1e}\n  p {p}\n  q {q}")
