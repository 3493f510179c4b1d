"""Metals from measured spectra: the integral against closed forms and a second observer, and what is refused."""

import numpy as np
import pytest

from lobe.lab import spectra
from lobe.lab.errors import InputError
from lobe.lab.paths import DATA

FLOAT64_ROUNDOFF = 2.0**-52
ENDS = np.array([0.3, 0.9])
HEADER = "wavelength_um,n,k\n"
FULL = HEADER + "0.3,1,2\n0.5,1,2\n0.9,1,2\n"


def constant(n, k):
    return ENDS, np.full(2, n), np.full(2, k)


def wyman_observer(nm):
    """Colour matching functions [3,w], the multi-lobe fit of Wyman, Sloan and Shirley 2013, section 2.2."""

    def lobe(height, centre, below, above):
        return height * np.exp(-0.5 * ((nm - centre) * np.where(nm < centre, below, above)) ** 2)

    return np.array([
        lobe(0.362, 442.0, 0.0624, 0.0374) + lobe(1.056, 599.8, 0.0264, 0.0323) + lobe(-0.065, 501.1, 0.0490, 0.0382),
        lobe(0.821, 568.8, 0.0213, 0.0247) + lobe(0.286, 530.9, 0.0613, 0.0322),
        lobe(1.217, 437.0, 0.0845, 0.0278) + lobe(0.681, 459.0, 0.0385, 0.0725),
    ])


def daylight(nm):
    """CIE D65 every 40 nm from 380 to 780 nm, relative to 560 nm, from the table of CIE 15."""
    table = [49.98, 93.43, 117.81, 115.92, 104.41, 100.0, 90.01, 83.70, 80.21, 78.28, 63.38]
    return np.interp(nm, np.arange(380, 781, 40), table)


def coarse_f0(name, light=daylight):
    """F0 by other means: a fitted observer, a coarse daylight, complex Fresnel, 5 nm, sRGB from its primaries."""
    nm = np.arange(380, 781, 5)
    wavelength, n, k = np.loadtxt(DATA / "ior" / name, delimiter=",", skiprows=1).T
    index = np.interp(nm, wavelength * 1000, n) - 1j * np.interp(nm, wavelength * 1000, k)
    mirror = abs((1 - index) / (1 + index)) ** 2
    seen = wyman_observer(nm) * light(nm)

    xy = np.array([[0.64, 0.33], [0.30, 0.60], [0.15, 0.06]])
    primaries = np.array([[x / y, 1, (1 - x - y) / y] for x, y in xy]).T
    # Each primary's strength is what white needs of it, and cancels where a mirror is white.
    return np.linalg.solve(primaries, seen @ mirror) / np.linalg.solve(primaries, seen.sum(axis=1))


@pytest.mark.parametrize("file, expected", [
    ("Au_Johnson.csv", (1.038, 0.728, 0.365)),
    ("Al_McPeak.csv", (0.906, 0.916, 0.923)),
])
def test_metals_agree_with_a_second_observer(file, expected):
    f0 = spectra.f0_linear_srgb(DATA / "ior" / file)
    assert f0.shape == (3,) and f0.dtype == np.float64
    assert np.abs(f0 - expected).max() <= 0.001
    assert np.abs(f0 - coarse_f0(file)).max() <= 0.004  # what the fit of the observer costs on gold


@pytest.mark.parametrize("n, k", [(1.5, 0.0), (0.2, 3.4), (2.9, 3.1), (0.0, 1.0)])
def test_a_constant_index_gives_the_grey_of_fresnel(n, k):
    grey = abs((1 - (n - 1j * k)) / (1 + (n - 1j * k))) ** 2
    assert np.abs(spectra.f0_linear_srgb(constant(n, k)) - grey).max() <= 16 * FLOAT64_ROUNDOFF


def test_limits():
    assert (spectra.f0_linear_srgb(constant(1.0, 0.0)) == 0).all()  # nothing to reflect from
    assert np.abs(spectra.f0_linear_srgb(constant(1.0, 1e9)) - 1).max() <= 1e-8  # a perfect mirror is white


def test_a_red_edge_is_red_and_leaves_the_gamut():
    wavelength = np.array([0.3, 0.600, 0.601, 0.9])
    red, green, blue = spectra.f0_linear_srgb((wavelength, np.ones(4), np.array([0.0, 0.0, 1e3, 1e3])))
    assert red > 0.5 and green < 0 and abs(blue) < 0.05


def test_spectra_side_by_side_are_converted_one_by_one():
    spectrum = np.linspace(0.2, 0.9, spectra.WAVELENGTHS_NM.size)
    both = spectra.linear_srgb(np.stack([spectrum, spectrum**2], axis=1))
    assert both.shape == (3, 2)
    assert np.allclose(both[:, 0], spectra.linear_srgb(spectrum), rtol=16 * FLOAT64_ROUNDOFF)


def test_columns_in_any_order_with_others_and_a_byte_order_mark(tmp_path):
    path = tmp_path / "a.csv"
    path.write_text("\ufeffk, note, wavelength_um ,n\r\n2,x,0.3,1\r\n\r\n4,y,0.9,3\r\n", encoding="utf-8")
    wavelength, n, k = spectra.read_nk(path)
    assert wavelength.tolist() == [0.3, 0.9] and n.tolist() == [1, 3] and k.tolist() == [2, 4]


@pytest.mark.parametrize("content, parts", [
    ("", ["is empty"]),
    ("\n", ["no column wavelength_um, n, k"]),
    ("wavelength_um,n\n0.3,1\n0.9,1\n", ["line 1", "no column k", "wavelength_um,n,k"]),
    ("um,n,kappa\n", ["no column wavelength_um, k;"]),
    (HEADER, ["0 rows", "at least 2"]),
    (HEADER + "0.5,1,1\n", ["1 rows", "at least 2"]),
    (FULL.replace("0.5,1,2", "0.5,one,2"), ["line 3", "'0.5,one,2'", "three numbers"]),
    (FULL.replace("0.5,1,2", "0.5,1"), ["line 3", "three numbers"]),
    (FULL.replace("0.5,1,2", "0.5,nan,2"), ["line 3", "finite"]),
    (FULL.replace("0.5,1,2", "0.5,1,inf"), ["line 3", "finite"]),
    (FULL.replace("0.5,1,2", "0.5,1,-2"), ["line 3", "not negative"]),
    (FULL.replace("0.5,1,2", "0.5,-1,2"), ["line 3", "not negative"]),
    (FULL.replace("0.5,1,2", "\n0.2,1,2"), ["line 4", "0.2 um after 0.3 um", "sort"]),
    (FULL.replace("0.5,1,2", "0.3,1,2"), ["line 3", "0.3 um after 0.3 um", "repeated"]),
    (HEADER + "0.4,1,2\n0.9,1,2\n", ["0.4 to 0.9 um", "0.38 to 0.78 um"]),
    (HEADER + "0.3,1,2\n0.7,1,2\n", ["0.3 to 0.7 um", "0.38 to 0.78 um"]),
    (HEADER + "300,1,2\n900,1,2\n", ["300 to 900 um", "in micrometres"]),
    (bytes(range(256)), ["expected the header wavelength_um,n,k"]),
])
def test_bad_table_is_refused_in_one_line(content, parts, tmp_path):
    path = tmp_path / "bad.csv"
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    with pytest.raises(InputError) as error:
        spectra.f0_linear_srgb(path)
    message = str(error.value)
    assert message.startswith(f"{path}: ") and "\n" not in message
    assert all(part in message for part in parts), message


def test_missing_table_is_refused(tmp_path):
    with pytest.raises(InputError, match="none.csv: no such file"):
        spectra.read_nk(tmp_path / "none.csv")
