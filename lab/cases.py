"""Exact answers at the inputs where the published formulas fail: data/stability/cases.json, and which function of the
library answers which of its families.

The answers are facts: 30 digits, computed at 50 for the binary32 inputs as they stand. No reference and no shader of
this repository had a part in them.
"""

from __future__ import annotations

import json
import re
from dataclasses import dataclass, field
from functools import cache

import numpy as np

from lobe import reference

from . import compare, geometry
from .catalogue import EXACT, Catalogue, Function
from .paths import DATA

FILE = DATA / "stability" / "cases.json"
LARGEST = 3.4e38  # of float32

# H, cosines and the like from vectors, in the forms that keep their digits.
_COSINES = "lobe_cosines(N, V, L, lobe_H(V, L))"
_VGROOVE = f"lobe_G_Vgroove({_COSINES}.x, {_COSINES}.y, dot(N, normalize(lobe_H(V, L))), lobe_LdotH(V, L))"


@dataclass(frozen=True)
class Family:
    """How a family of cases is asked of the library.

    call      GLSL of type float, in the family's inputs; nx, ny, nz are N, and so on
    factor    by which the family's answers are multiplied
    promised  name -> the range of an input in which a number is promised; beyond it, only a finite one
    of        the function that answers, where the first one that `call` names is overloaded
    """

    name: str
    call: str
    factor: float = 1.0
    promised: dict[str, tuple[float, float]] = field(default_factory=dict)
    of: str = ""


FAMILIES = (
    Family("fresnel_dielectric", "lobe_F_dielectric(c, n)"),
    Family("fresnel_dielectric_T", "lobe_T_dielectric(c, n)"),
    Family("fresnel_conductor", "lobe_F_conductor(u, n, k)", of="lobe_F_conductor(float,float,float)"),
    Family("schlick", "lobe_F_Schlick(c, vec3(f0)).x", of="lobe_F_Schlick(float,vec3)"),
    Family("hall", "lobe_F_Hall(cosI, vec3(Fl0), eta0).x", promised={"Fl0": (0.01, 1.0), "eta0": (1.0, 10.0)}),
    Family("ndf_ggx_scalar", "lobe_D_GGX(c, a)", of="lobe_D_GGX(float,float)"),
    Family("ndf_beckmann_scalar", "lobe_D_Beckmann(c, m)", of="lobe_D_Beckmann(float,float)"),
    Family("ndf_blinn_phong", "lobe_D_BlinnPhong(c, e)", of="lobe_D_BlinnPhong(float,float)"),
    Family("ndf_gaussian_lecture", "lobe_D_Gaussian(c, m)", of="lobe_D_Gaussian(float,float)"),
    Family("ndf_ggx_vec", "lobe_D_GGX(N, lobe_H(V, L), a)", of="lobe_D_GGX(vec3,vec3,float)"),
    Family("ndf_beckmann_vec", "lobe_D_Beckmann(N, lobe_H(V, L), m)", of="lobe_D_Beckmann(vec3,vec3,float)"),
    Family("ndf_blinn_vec", "lobe_D_BlinnPhong(N, lobe_H(V, L), e)", of="lobe_D_BlinnPhong(vec3,vec3,float)"),
    Family("ndf_ggx_aniso", "lobe_D_GGX_aniso(hz, hx, hy, ax, ay)"),
    Family("ndf_beckmann_aniso", "lobe_D_Beckmann_aniso(hz, hx, hy, ax, ay)"),
    Family("ward_lecture", "lobe_D_Ward_aniso(hz, hx, hy, mx, my)"),
    Family("ashikhmin_shirley_pdf", "lobe_D_AshikhminShirley(hz, hx, hy, eu, ev)"
           " * sqrt((eu + 1.0) * (ev + 1.0) / ((eu + 2.0) * (ev + 2.0)))"),
    Family("g1_smith_ggx", "lobe_G1_GGX(c, a)", promised={"c": (1e-6, 1.0)}),
    Family("g1_smith_beckmann", "lobe_G1_Beckmann(c, a)", promised={"c": (1e-6, 1.0)}),
    Family("vis_ggx_corr_x_nl", "lobe_V_GGX(nv, nl, a) * nl", promised={"nl": (1e-6, 1.0), "nv": (1e-6, 1.0)}),
    Family("g_cook_torrance", _VGROOVE),
    Family("l_dot_h", "lobe_LdotH(V, L)"),
    Family("kelemen", "lobe_V_Kelemen(V, L)", factor=0.25, of="lobe_V_Kelemen(vec3,vec3)"),
    Family("oren_nayar_qualitative", "lobe_OrenNayar_qualitative(N, V, L, vec3(1.0), sigma).x", factor=1 / np.pi),
    # 1 / (1 + c1 r) with EON's c1 = 1/2 - 2 / (3 pi) is the A of the loss's header
    Family("eon_E_FON", "1.0 - r / (1.0 + 0.287793409 * r) * lobe_loss_EON(mu)"),
    Family("lafortune", "lobe_Lafortune_lobe(L, V, C, h)", promised={"h": (0.1, 400.0)}),
    Family("schlick_rational", "lobe_pow_Schlick(S, h)"),
    Family("cos_refracted", "lobe_cosT(c, n)"),
    Family("jensen_dipole", "lobe_Rd_dipole(r, sa, ss, eta)"),
    Family("ggx_schlick_full", "lobe_GGX(N, V, L, vec3(f0), a).x * dot(N, L)", promised={"f0": (0.0, 1.0)}),
    Family("ggx_directional_albedo", "lobe_albedo_GGX(mu, a)"),
    Family("policy_degenerate", "lobe_GGX(N, V, L, vec3(f0), a).x"),
)


@dataclass(frozen=True)
class Cases:
    """The cases of one family.

    inputs    name -> float32 [1, n, width], as the family's call names them
    expected  float64 [n]; NaN where only a finite value, not negative, is asked
    allowed   float64 [n]: what the answer may be off
    """

    family: Family
    functions: tuple[Function, ...]
    inputs: dict[str, np.ndarray]
    expected: np.ndarray
    allowed: np.ndarray

    def errors(self, got: np.ndarray) -> np.ndarray:
        """Error over what is allowed, [n]; infinite where a value is not finite or negative."""
        zero = np.abs(self.expected) < compare.SMALLEST_REFERENCE
        with np.errstate(invalid="ignore", divide="ignore"):
            ratio = np.abs(got - self.expected) / self.allowed
        ratio[zero] = np.where(got[zero] <= 2 * compare.SMALLEST_REFERENCE, 0.0, np.inf)
        ratio[np.isnan(self.expected)] = 0.0
        return np.where(np.isfinite(got) & (got >= 0), ratio, np.inf)


@cache
def _content() -> dict:
    return json.loads(FILE.read_text())["families"]


def units(functions: tuple[Function, ...]) -> int:
    """K of a call: the largest of its functions."""
    return max(f.units for f in functions)


def answered(library: Catalogue) -> list[Family]:
    """Those families whose functions exist."""
    names = {f.name for f in library.functions} | {f.key for f in library.functions} | {""}
    return [family for family in FAMILIES if {*re.findall(r"lobe_\w+", family.call), family.of} <= names]


def unanswered(library: Catalogue) -> list[str]:
    """Families that no function of the library answers yet."""
    known = {family.name for family in answered(library)}
    return [name for name in _content() if name not in known]


def rows(name: str) -> list[dict]:
    """A family's cases as the file has them: inputs by name, expected (text or None), kappa."""
    family = _content()[name]
    return [dict(zip((*family["inputs"], "expected", "kappa"), row)) for row in family["rows"]]


def load(library: Catalogue, family: Family) -> Cases:
    """A family's cases, ready for a shader."""
    cases = rows(family.name)
    columns = {name: np.array([case[name] for case in cases], np.float32)[None, :, None]
               for name in _content()[family.name]["inputs"]}
    expected = np.array([_number(case["expected"]) for case in cases]) * family.factor
    moved = _with_angles(columns, expected) if family.name == "hall" else 0.0
    for name, (low, high) in family.promised.items():
        x = columns[name][0, :, 0]
        expected[((x < np.float32(low)) | (x > np.float32(high))) & (expected != 0)] = np.nan
    expected[np.abs(expected) > LARGEST] = np.nan
    inputs = _grouped(columns)
    if family.name == "policy_degenerate":
        below = np.minimum(*(geometry.dot(inputs["N"][0].astype(float), inputs[x][0]) for x in "VL"))[:, 0] <= 0
        expected[below] = 0.0
    kappa = np.array([case["kappa"] or 0.0 for case in cases])
    first, *others = re.findall(r"lobe_\w+", family.call)
    functions = tuple(dict.fromkeys(library.find(name)[0] for name in (family.of or first, *others)))
    allowed = units(functions) * compare.FLOAT32_ROUNDOFF * (1 + kappa) * np.abs(expected) + moved
    for f in functions:
        if f.approximation and f.approximation.name == EXACT:
            allowed = allowed + f.approximation.error(expected)
    return Cases(family, functions, inputs, expected, allowed)


def _with_angles(columns: dict[str, np.ndarray], expected: np.ndarray) -> np.ndarray:
    """Hall's shift is given by reflectances, Fa at an angle and F0 along the normal; lobe_F_Hall takes the angle and the
    index. Adds the ones that float32 has nearest, makes answers NaN that have none, and returns by how much the others
    move."""
    F_dielectric, eta_of = "lobe_F_dielectric(float,float)", "lobe_eta(float)"
    Fl0, Fa, F0 = (columns[name][0].astype(float) for name in ("Fl0", "Fa", "F0"))
    eta = reference.evaluate(eta_of, F0).astype(np.float32).astype(float)
    low, high = np.zeros_like(Fa), np.ones_like(Fa)  # F falls as the cosine grows
    for _ in range(60):
        middle = (low + high) / 2
        above = reference.evaluate(F_dielectric, np.hstack([middle, eta])) > Fa
        low, high = np.where(above, middle, low), np.where(above, high, middle)
    cosine = high.astype(np.float32)
    there, F0 = (reference.evaluate(F_dielectric, np.hstack([c.astype(float), eta])) for c in (cosine, np.ones_like(eta)))
    moved = (Fl0 + (1 - Fl0) * np.maximum(there - F0, 0) / (1 - F0))[:, 0]
    expected[(Fa < F0)[:, 0]] = np.nan
    columns |= {"cosI": cosine[None], "eta0": eta.astype(np.float32)[None]}
    return np.abs(moved - expected)


def _number(text: str | None) -> float:
    return np.nan if text is None else float(text)


def _grouped(columns: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Columns of scalars, with those of vectors joined: nx, ny, nz to N, where all three are there."""
    joined = {}
    for short, name in (("n", "N"), ("v", "V"), ("l", "L"), ("C", "C")):
        parts = [f"{short}{axis}" for axis in "xyz"]
        if all(part in columns for part in parts):
            joined[name] = np.concatenate([columns.pop(part) for part in parts], axis=-1)
    return columns | joined
