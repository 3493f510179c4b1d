"""From measured spectra to colours: complex index of refraction -> reflectance -> linear sRGB."""

import csv
import functools

import numpy as np

from .errors import InputError
from .files import read_bytes

VISIBLE_UM = (0.38, 0.78)
WAVELENGTHS_NM = np.arange(380.0, 781.0)
_LARGEST = 1e6  # of what a table may hold: far above any index of refraction, and its fourth power is no overflow
_COLUMNS = ("wavelength_um", "n", "k")


def read_nk(path):
    """
    Reads a table with the columns wavelength_um, n, k (index of refraction n + ik), in any order, others ignored.

    Returns three float64 arrays of one length: wavelength [um], rising; n; k. InputError unless there are at least two
    rows of finite numbers, n and k are not negative, and the wavelengths rise and cover VISIBLE_UM.
    """
    text = read_bytes(path).decode("utf-8-sig", errors="replace")
    try:
        reader = csv.DictReader(text.splitlines(), skipinitialspace=True)
        columns = [name.strip() for name in reader.fieldnames or ()]
        missing = [name for name in _COLUMNS if name not in columns]
        if missing:
            raise InputError(
                f"{path}: line 1: no column {', '.join(missing)}; expected the header {','.join(_COLUMNS)}"
            )
        reader.fieldnames = columns
        rows, lines = [], []
        for row in reader:
            rows.append(_numbers(row, f"{path}: line {reader.line_num}"))
            lines.append(reader.line_num)
    except csv.Error as error:
        raise InputError(f"{path}: is not a CSV table ({error}); expected the header {','.join(_COLUMNS)}") from None
    if len(rows) < 2:
        raise InputError(f"{path}: {len(rows)} rows of numbers, expected at least 2, from 0.38 to 0.78 um")
    for before, row, line in zip(rows, rows[1:], lines[1:]):
        if not before[0] < row[0]:
            raise InputError(f"{path}: line {line}: wavelength {row[0]:g} um after {before[0]:g} um, expected "
                             "rising wavelengths; sort the rows and remove repeated ones")
    wavelength, n, k = np.array(rows).T
    if wavelength[0] > VISIBLE_UM[0] or wavelength[-1] < VISIBLE_UM[1]:
        raise InputError(f"{path}: covers {wavelength[0]:g} to {wavelength[-1]:g} um, expected at least "
                         "0.38 to 0.78 um; add the missing wavelengths, in micrometres")
    return wavelength, n, k


def _numbers(row, where):
    """The three numbers of a row of the table."""
    try:
        values = [float(row[name]) for name in _COLUMNS]
    except (TypeError, ValueError):
        found = ",".join(str(row[name] or "") for name in _COLUMNS)
        raise InputError(f"{where}: {found!r}, expected three numbers {','.join(_COLUMNS)}") from None
    if not all(0 <= value <= _LARGEST for value in values):
        raise InputError(f"{where}: {values[0]:g},{values[1]:g},{values[2]:g}, expected {','.join(_COLUMNS)} "
                         f"that are finite, not negative and up to {_LARGEST:g}")
    return values


def reflectance(n, k):
    """Reflectance at normal incidence of a surface in vacuum, |(1 - n + ik) / (1 + n - ik)|^2: Fresnel, 0..1."""
    return ((n - 1) ** 2 + k**2) / ((n + 1) ** 2 + k**2)


def sampled(source):
    """n and k at WAVELENGTHS_NM, interpolated linearly. `source` is a table's path, or what read_nk returns of it."""
    wavelength, *values = source if isinstance(source, tuple) else read_nk(source)
    return tuple(np.interp(WAVELENGTHS_NM / 1000, wavelength, v) for v in values)


@functools.cache
def _response():
    """What a reflectance of 1 at each of WAVELENGTHS_NM adds to red, green and blue, [3,w]; each row sums to 1."""
    import colour  # takes 0.8 s, so only who needs it waits

    observer = colour.MSDS_CMFS["CIE 1931 2 Degree Standard Observer"]
    light = colour.SDS_ILLUMINANTS["D65"]  # linear between its 5 nm, as CIE 15 defines it
    seen = np.interp(WAVELENGTHS_NM, light.wavelengths, light.values) * [
        np.interp(WAVELENGTHS_NM, observer.wavelengths, curve) for curve in observer.values.T
    ]
    rgb = colour.RGB_COLOURSPACES["sRGB"].matrix_XYZ_to_RGB @ seen
    return rgb / rgb.sum(axis=1, keepdims=True)


def linear_srgb(spectrum):
    """
    Linear sRGB of a reflectance under illuminant D65, for the CIE 1931 2 degree observer.

    spectrum  reflectance at WAVELENGTHS_NM, [w] or [w,n]
    Returns float64 [3] or [3,n]; a perfect mirror has (1, 1, 1). Colours outside the gamut keep components below 0 or
    above 1.
    """
    return _response() @ spectrum


def f0_linear_srgb(source):
    """Linear sRGB of the reflectance at normal incidence, float64 [3]. `source` as for sampled."""
    return linear_srgb(reflectance(*sampled(source)))
