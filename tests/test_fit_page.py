"""docs/fits.md and what it rests on: He and Torrance's model, the stored figures, the figures drawn."""

import json

import mpmath as mp
import numpy as np
import pytest

from lobe import reference
from lobe.lab import fit_page, he_torrance, lafortune, plots, quadrature, samples

FOUND = json.loads(fit_page.RESULTS.read_text())
REPAIR = "repair: .venv/bin/python -m lobe.lab.fit_page"
BECKMANN = "lobe_D_Beckmann(float,float)"


def lit(view, light, azimuth=0.0):
    return quadrature.spherical(np.radians(view), np.pi), quadrature.spherical(np.radians(light), np.radians(azimuth))


class TestHeTorrance:
    @pytest.mark.parametrize("sigma0, tau", [(0.1, 2.0), (0.1, 5.0), (0.18, 3.0)])
    @pytest.mark.parametrize("view", [0, 45])
    def test_a_perfect_mirror_loses_nothing(self, sigma0, tau, view):
        """What is scattered and what is mirrored, exp(-g) of the unshadowed, add up to 1; less nearer grazing."""
        (_, _, V, L), weight = quadrature.lights(np.radians(view), 60, 48)
        scattered = weight @ he_torrance.reflectance(V, L, None, sigma0, tau, 0.5)
        c = np.cos(np.radians([view]))
        g, seen = he_torrance.apparent_roughness(c, c, sigma0, tau, 0.5), he_torrance.shadowing(c, sigma0, tau)
        mirrored = np.exp(-g) * seen**2
        assert scattered + mirrored[0] == pytest.approx(1, abs=3e-4)
        assert scattered > 0.5

    def test_a_very_rough_surface_is_beckmanns(self):
        """For g to infinity: F S D / (4 NdotV NdotL) with facets of alpha = 2 sigma / tau."""
        V, L = lit([10, 30, 50], [40, 30, 20], [0, 20, 90])
        got = he_torrance.reflectance(V, L, None, 20.0, 120.0, 0.5)
        H = (V + L) / np.linalg.norm(V + L, axis=1, keepdims=True)
        D = reference.evaluate(BECKMANN, np.stack([H[:, 2], np.full(3, 40 / 120)], axis=1))[:, 0]
        S = he_torrance.shadowing(V[:, 2], 20.0, 120.0) * he_torrance.shadowing(L[:, 2], 20.0, 120.0)
        assert np.allclose(got, S * D / (4 * V[:, 2] * L[:, 2]), rtol=1e-3)

    def test_agrees_with_mpmath(self):
        """The printed equations, term by term, Newton's root in place of Lambert's function."""
        sigma0, tau, wavelength, index = 0.28, 1.77, 0.5, 0.6 + 5.3j
        V, L = lit([35], [60], [25])
        with mp.workdps(30):
            v, l = ([mp.mpf(float(x)) for x in X[0]] for X in (V, L))
            h = [a + b for a, b in zip(v, l)]
            hh = sum(x * x for x in h)

            def u(c):
                return tau / (2 * mp.mpf(sigma0)) * c / mp.sqrt(1 - c * c)

            def S1(c):
                lam = (mp.exp(-u(c) ** 2) / (mp.sqrt(mp.pi) * u(c)) - mp.erfc(u(c))) / 2
                return (1 - mp.erfc(u(c)) / 2) / (1 + lam)

            K = sum(mp.tan(mp.acos(c)) * mp.erfc(u(c)) for c in (v[2], l[2]))
            x = mp.findroot(lambda x: x * mp.exp(x * x / 2) - K / mp.sqrt(8 * mp.pi), 0.1)
            g = (2 * mp.pi * sigma0 / mp.sqrt(1 + x * x) / wavelength * (v[2] + l[2])) ** 2
            vxy2 = (2 * mp.pi / wavelength) ** 2 * (h[0] ** 2 + h[1] ** 2)
            X = vxy2 * tau**2 / 4
            total = mp.fsum(g**m * mp.exp(-g - X / m) / (mp.factorial(m) * m) for m in range(1, 401))
            D = mp.pi**2 * tau**2 / (4 * wavelength**2) * total
            c, n2 = mp.sqrt(hh) / 2, mp.mpc(index) ** 2
            inside = mp.sqrt(n2 - 1 + c * c)
            F = (abs((c - inside) / (c + inside)) ** 2 + abs((n2 * c - inside) / (n2 * c + inside)) ** 2) / 2
            exact = F * (hh / h[2]) ** 2 * S1(v[2]) * S1(l[2]) * D / (mp.pi * v[2] * l[2])
        got = he_torrance.reflectance(V, L, index, sigma0, tau, wavelength)[0]
        assert got == pytest.approx(float(exact), rel=1e-11)

    def test_is_reciprocal(self):
        V, L = lit([20, 70], [65, 5], [10, 80])
        there, back = (he_torrance.reflectance(a, b, 1 + 5j, 0.28, 1.77, 0.5) for a, b in ((V, L), (L, V)))
        assert np.allclose(there, back, rtol=1e-13)


class TestPage:
    def test_is_up_to_date(self):
        assert fit_page.PAGE.read_text(encoding="utf-8") == fit_page.page(FOUND), REPAIR

    @pytest.mark.parametrize("name", fit_page.DRAWINGS)
    def test_curves_of_the_simulation_are_those_drawn(self, name):
        """The fits' own curves may differ in their last digits between versions of SciPy: the simulation's may not."""
        figure = plots.drawn(*fit_page.DRAWINGS[name])
        assert len(figure.axes) == 8 and (fit_page.FIGURES / name).stat().st_size > 1e4
        out = np.radians(np.linspace(-89.9, 89.9, 361))
        for axes, view in zip(figure.axes, (*fit_page.SHOWN, fit_page.BEYOND)):
            assert np.allclose(axes.get_lines()[0].get_ydata(), fit_page.plane(fit_page.aluminium, view, out))

    @pytest.mark.parametrize("name", ["all", "three"])
    def test_aluminium_is_fitted_as_stored(self, name):
        """Another SciPy may find a better minimum, not a worse one."""
        assert fit_page.fitted(name).residual[0] == pytest.approx(FOUND["aluminium"][name]["residual"], rel=1e-3)

    def test_another_seed_finds_the_same(self):
        again = lafortune.fit(samples.of("again", fit_page.aluminium), 3, seed=11)
        assert again.residual[0] == pytest.approx(FOUND["aluminium"]["all"]["residual"], rel=1e-3)

    def test_published_fits_have_the_stored_albedo_by_the_reference(self):
        """By the shader's reference over another rule of quadrature."""
        for name, lobes in fit_page.published().items():
            (N, T, V, L), weight = quadrature.lights(np.radians(60))
            row = np.concatenate(list(fit_page.shader_parameters(lobes).values()))
            f = reference.evaluate(fit_page.LAFORTUNE3, np.hstack([N, T, V, L, np.broadcast_to(row, (len(V), 39))]))
            stored = FOUND["materials"][name]["albedo"][fit_page.VIEWS.index(60)]
            assert weight @ f == pytest.approx(stored, rel=1e-3), name
