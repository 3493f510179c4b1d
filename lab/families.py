"""Families of alternatives: functions that stand for the same exact term, each called from the same inputs.

A function of the library joins by its header's line `family` where its parameters can be formed from a chart's inputs.
So do the functions of other libraries (peers.py), and expressions too short to be a function.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cache

import numpy as np

from lobe import reference

from . import bundle, catalogue, geometry, metals, scenes
from .catalogue import WIDTHS, Catalogue, Function
from .errors import InputError
from .isa import Call

Inputs = dict[str, np.ndarray]  # name -> [n, width]
POINTS, SEED = 1 << 13, 2026
ISOTROPY = 0.5  # Schlick's p
OURS, TEXTBOOK = "lobe", "textbook"
POWER = "s^n"  # the one exact term that no function of the reference is
PICTURE_ALPHAS = (0.03, 0.15, 0.5)
GGX, D_GGX = "lobe_GGX(vec3,vec3,vec3,vec3,float)", "lobe_D_GGX(vec3,vec3,float)"
D_BECKMANN, G1_BECKMANN = "lobe_D_Beckmann(vec3,vec3,float)", "lobe_G1_Beckmann(float,float)"
V_GGX, SCHLICK = "lobe_V_GGX(float,float,float)", "lobe_F_Schlick(float,vec3)"
OREN_NAYAR, EON = (f"lobe_OrenNayar{x}(vec3,vec3,vec3,vec3,float)" for x in ("", "_EON"))
STANDS_FOR = {"lobe_GGX_Kelemen": GGX, "lobe_Lambert": OREN_NAYAR, "lobe_OrenNayar_qualitative": OREN_NAYAR}
"""Of what no header calls an approximation, since it is a model in its own right, and people take it for another."""

PEERS_OF = {"distribution": "lobe_D_GGX", "masking-beckmann": "lobe_G1_Beckmann"}
"""Of whose counterparts in other libraries a chart shows; of all that it can call where nothing is named."""


@dataclass(frozen=True)
class Member:
    """One alternative, as a chart calls it."""

    origin: str  # lobe, textbook, or another library's name
    name: str  # as a chart shows it
    source: str  # GLSL that the call needs
    call: str  # in the names of the chart's inputs
    result: str
    stands_for: str  # key of the exact term
    factor: str = ""  # brings another library's value into our units; not counted as cost
    key: str = ""  # the library's function, for ours
    formula: str = ""
    cited: str = ""


@dataclass(frozen=True)
class Chart:
    """One chart, and the measurement behind it.

    inputs    what a call is given, name -> GLSL type; for ISA all of them vary
    forms     parameter -> GLSL over inputs, where it is not an input itself
    exact     key of the exact term; `own` where a member that approximates nothing stands for itself
    sample    count -> float32 inputs: the domain of the errors, which `domain` says in words
    template  (pixels, alpha) -> (inputs, weights) of a picture: [lights, n, width], and what a member is multiplied by
    """

    name: str
    family: str
    title: str
    inputs: dict[str, str]
    exact: str
    domain: str
    sample: Callable[[int], Inputs]
    template: Callable[[scenes.Pixels, float], tuple[Inputs, np.ndarray]]
    forms: dict[str, str] = field(default_factory=dict)
    own: bool = False
    alphas: tuple[float, ...] = PICTURE_ALPHAS
    textbook: tuple[tuple[str, str, str, str], ...] = ()  # name, call, result, source of the expression

    def bound(self, call: str, parameters: dict[str, str]) -> str | None:
        """The call in the chart's inputs; None where a parameter cannot be formed from them."""
        for name, kind in parameters.items():
            form = self.forms.get(name, name if name in self.inputs else None)
            if form is None:
                return None
            have = self.inputs.get(form, kind)
            if (have, kind) == ("float", "vec3"):
                form = f"vec3({form})"
            elif have != kind:
                return None
            if form != name:
                call = re.sub(rf"\b{name}\b", form if re.fullmatch(r"\w+|vec3\(\w+\)", form) else f"({form})", call)
        return call

    def valued(self, member: Member) -> str:
        """The call in our units."""
        return f"({member.call}) * ({member.factor})" if member.factor else member.call

    def weighed(self, member: Member) -> Call:
        """For isa and time: the inputs that the call uses."""
        return Call(member.source, member.call, member.result,
                    tuple((n, t) for n, t in self.inputs.items() if re.search(rf"\b{n}\b", member.call)))


def exact_values(stands_for: str, x: Inputs) -> np.ndarray:
    """The exact term in double precision at inputs [..., width], by the parameters' names."""
    x = {name: values.astype(np.float64) for name, values in (x | aliases(x)).items()}
    if stands_for == POWER:
        return x["s"] ** x["exponent"]
    (function,) = catalogue.load().find(stands_for)
    shape = next(iter(x.values())).shape[:-1]
    columns = (np.broadcast_to(x[p.name], (*shape, p.width)).reshape(-1, p.width) for p in function.parameters)
    return reference.evaluate(function.key, np.concatenate([*columns], axis=1)).reshape(*shape, -1)


def aliases(x: Inputs) -> Inputs:
    """Inputs by the other names that functions have for them."""
    same = {"rs": "f0", "h": "exponent", "nu": "exponent", "nv": "exponent", "T": "X", "alphaX": "alpha", "alphaY": "alpha"}
    return {name: x[other] for name, other in same.items() if other in x}


def members(chart: Chart, with_peers: bool = False, library: Catalogue | None = None,
            guards: bool = True) -> list[Member]:
    """All that the chart shows; without `guards`, other libraries' functions as they are."""
    library = library or catalogue.load()
    found = [_ours(chart, library, f) for f in library.functions if f.family == chart.family]
    found += [Member(TEXTBOOK, name, "", call, result, chart.exact, formula=call, cited=cited)
              for name, call, result, cited in chart.textbook]
    if with_peers:
        from . import peers

        found += [_peer(chart, p, guards) for p in peers.members(chart.family)]
    return _plainest([m for m in found if m])


def _ours(chart: Chart, library: Catalogue, f: Function) -> Member | None:
    call = chart.bound(f.call, {p.name: p.type for p in f.parameters})
    stands_for = _stands_for(chart, library, f)
    if call is None or (WIDTHS[f.result] == 2) != (chart.name == "albedo"):
        return None
    return Member(OURS, library.label(f), bundle.bundle(library, [f.key]), call, f.result, stands_for, key=f.key,
                  formula=" ".join(f.formula), cited=f.source)


def _stands_for(chart: Chart, library: Catalogue, f: Function) -> str:
    if not chart.own:
        return chart.exact
    named = f.approximation.name if f.approximation else ""
    named = f.name.removesuffix("_fast") if named == catalogue.EXACT else named  # where it has a function of its own
    others = [g.key for g in library.functions if g.name == named and len(g.parameters) == len(f.parameters)]
    return STANDS_FOR.get(f.name) or (others[0] if others else f.key)


def _peer(chart: Chart, peer, guards: bool) -> Member | None:
    """A function of another library, with our guards on its inputs. What computes a formula of its own on purpose
    stands beside whole lobes of ours only where it approximates one."""
    from . import peers_measured

    p = peers_measured.guarded(peer) if guards else peer
    call = p.call
    if p.function.name.startswith("lobe_G2_"):  # masking without the foreshortening, by which every lobe divides
        call = f"{call} / (4.0 * NdotV * NdotL)"
    words = set(re.findall(r"\w+", call))
    call = chart.bound(call, p.parameters | {n: "vec3" for n in ("N", "V", "L", "H", "X") if n in words})
    is_another = bool(chart.own and p.exact and not p.stands_for)
    is_another |= not p.function.name.startswith(PEERS_OF.get(chart.name, ""))
    if call is None or is_another or (WIDTHS[p.function.result] == 2) != (chart.name == "albedo"):
        return None
    stands_for = p.stands_for or _stands_for(chart, catalogue.load(), p.function) if chart.own else chart.exact
    return Member(p.origin, p.name, p.source, call, p.function.result, stands_for, p.factor,
                  formula=p.formula or p.note, cited=f"{p.origin} {p.package.version}")


def _plainest(found: list[Member]) -> list[Member]:
    """Of overloads that differ only in whether a grey value was widened, the one that was not."""
    plain = {(m.origin, m.name.partition("(")[0]) for m in found if "vec3(" not in m.call}
    return [m for m in found if m.name.startswith("lobe_D_") or "vec3(f0)" not in m.call
            or (m.origin, m.name.partition("(")[0]) not in plain]


# Domains. Directions as an image has them: half vectors follow the distribution, 30 % of the views are near grazing.

def highlights(count: int, lowest: float = 0.003) -> Inputs:
    rng = np.random.default_rng(SEED)
    n = 3 * count
    alpha = lowest ** rng.random((n, 1))
    N = geometry.normalize(rng.normal(size=(n, 3)))
    T, u = _tangent(N), rng.random((n, 1))
    H = _direction(rng, N, T, 1 / np.sqrt(1 + alpha**2 * u / (1 - u)))
    near = rng.random((n, 1)) < 0.3
    V = _direction(rng, N, T, np.where(near, 10 ** rng.uniform(-3, -1, (n, 1)), rng.random((n, 1))))
    L = 2 * geometry.dot(V, H) * H - V
    seen = np.flatnonzero((np.minimum(geometry.dot(N, L), geometry.dot(V, H)) > 1e-4)[:, 0])[:count]
    return _rounded({"N": N[seen], "V": V[seen], "L": L[seen], "X": T[seen], "alpha": alpha[seen],
                     "perceptual": np.sqrt(alpha[seen]), "exponent": np.maximum(2 / alpha[seen] ** 2 - 2, 1.0),
                     "r": alpha[seen] ** 2, "p": np.full((len(seen), 1), ISOTROPY),
                     "f0": np.where(rng.random((len(seen), 1)) < 0.5, 0.04, rng.uniform(0.3, 1.0, (len(seen), 3)))})


def _tangent(N: np.ndarray) -> np.ndarray:
    axis = np.where(np.abs(N[..., :1]) < 0.7, [1.0, 0.0, 0.0], [0.0, 1.0, 0.0])
    return geometry.normalize(np.cross(N, axis))


def _direction(rng, N, T, cosine):
    azimuth, sine = rng.uniform(0, 2 * np.pi, cosine.shape), np.sqrt((1 - cosine) * (1 + cosine))
    return N * cosine + (T * np.cos(azimuth) + np.cross(N, T) * np.sin(azimuth)) * sine


def _rounded(x: Inputs) -> Inputs:
    return {name: values.astype(np.float32) for name, values in x.items()}


def _half(x: Inputs) -> Inputs:
    """With H = V + L of the rounded vectors."""
    return {"N": x["N"], "H": x["V"] + x["L"], "X": x["X"], "alpha": x["alpha"]}


def _gaussian_halves(count: int) -> Inputs:
    """Half vectors of Beckmann's distribution."""
    rng = np.random.default_rng(SEED)
    alpha = 0.7 * (0.003 / 0.7) ** rng.random((count, 1))
    N = geometry.normalize(rng.normal(size=(count, 3)))
    tangent2 = -(alpha**2) * np.log1p(-rng.random((count, 1)))
    H = _direction(rng, N, _tangent(N), 1 / np.sqrt(1 + tangent2)) * rng.uniform(0.1, 2, (count, 1))
    return _rounded({"N": N, "H": H, "alpha": alpha, "exponent": 2 / alpha**2 - 2})


def _one_sided(count: int) -> Inputs:
    rng = np.random.default_rng(SEED)
    alpha = 0.01 ** rng.random((count, 1))
    return _rounded({"NdotX": _over(rng, count, 1e-3, 1), "alpha": alpha, "r": np.sqrt(2 / np.pi) * alpha})


COSINES = ("NdotV", "NdotL", "NdotH", "LdotH", "VdotH")


def _cosines(x: Inputs) -> Inputs:
    """All cosines that masking terms take."""
    frame = [x[n].astype(np.float64) for n in ("N", "X", "V", "L")]
    return _rounded({n: np.clip(geometry.FORM[n](*frame), 1e-6, 1) for n in COSINES} | {"alpha": x["alpha"]})


def _dielectrics(count: int) -> Inputs:
    rng = np.random.default_rng(SEED)
    eta = rng.uniform(1.2, 2.5, (count, 1)).astype(np.float32)
    return {"cosI": _over(rng, count), "eta": eta, "f0": (((eta - 1.0) / (eta + 1.0)) ** 2).astype(np.float32)}


def _over(rng, count: int, low: float = 0.0, high: float = 1.0) -> np.ndarray:
    return rng.uniform(low, high, (count, 1)).astype(np.float32)


@cache
def _metals() -> tuple[np.ndarray, np.ndarray]:
    """eta and k of the measured metals, [metals, 3]."""
    fits = [metals.fitted(m) for m in metals.METALS]
    return np.array([f.eta for f in fits]), np.array([f.k for f in fits])


def _conductors(eta: np.ndarray, k: np.ndarray, cosI: np.ndarray) -> Inputs:
    """What the terms for metals take, made of eta and k."""
    f0 = ((eta - 1) ** 2 + k**2) / ((eta + 1) ** 2 + k**2)
    triple = (np.full(eta[..., :1].shape, 1 / 7), eta, k)
    f82 = exact_values("lobe_F_conductor(float,vec3,vec3)", dict(zip(("cosI", "eta", "k"), triple)))
    root = np.sqrt(np.minimum(f0.mean(-1, keepdims=True), 0.98))
    return _rounded({"cosI": cosI, "eta": eta, "k": k, "f0": f0, "f82": f82, "eta0": (1 + root) / (1 - root),
                     "tint": f82 / (f0 + (1 - f0) * (6 / 7) ** 5)})


def _metal_angles(count: int) -> Inputs:
    rng = np.random.default_rng(SEED)
    which = rng.integers(0, len(metals.METALS), count)
    eta, k = _metals()
    return _conductors(eta[which], k[which], rng.random((count, 1)))


def _diffuse(count: int) -> Inputs:
    rng = np.random.default_rng(SEED)
    N = geometry.normalize(rng.normal(size=(count, 3)))
    T = _tangent(N)
    V, L = (_direction(rng, N, T, rng.uniform(0.01, 1, (count, 1))) for _ in range(2))
    return _rounded({"N": N, "V": V, "L": L, "albedo": rng.uniform(0.02, 0.98, (count, 3)),
                     "sigma": _over(rng, count, 0, 0.6), "roughness": _over(rng, count)})


def _powers(count: int) -> Inputs:
    rng = np.random.default_rng(SEED)
    exponent = np.exp(rng.uniform(0, np.log(1e4), (count, 1)))
    s = np.exp(-rng.uniform(0, np.log(100), (count, 1)) / exponent)
    return _rounded({"s": s, "exponent": exponent, "width": np.sqrt(2 / exponent)})


def _views(count: int) -> Inputs:
    rng = np.random.default_rng(SEED)
    alpha = _over(rng, count, 0.01, 1)
    return {"NdotV": _over(rng, count, 0.01, 1), "alpha": alpha, "perceptual": np.sqrt(alpha),
            "roughness": _over(rng, count), "albedo": rng.uniform(0.02, 0.98, (count, 3)).astype(np.float32)}


# Pictures: a member's value times the rest of its family's whole lobe, and the light.

def _frame(seen: scenes.Pixels, alpha: float, **constants) -> Inputs:
    """Directions and constants at each pixel, [lights, n, width]."""
    shape = seen.L.shape[:2]
    spread = {n: np.broadcast_to(v, seen.L.shape) for n, v in (("N", seen.N), ("V", seen.V), ("X", seen.T))}
    constants |= {"alpha": alpha, "perceptual": np.sqrt(alpha), "exponent": 2 / alpha**2 - 2, "r": alpha**2, "p": ISOTROPY}
    values = {n: np.broadcast_to(np.atleast_1d(v), (*shape, np.size(v))) for n, v in constants.items()}
    return _rounded(spread | {"L": seen.L} | values)


def _terms(seen: scenes.Pixels, alpha: float, *keys: str) -> np.ndarray:
    """E times exact terms of GGX with f0 = 0.5, 0 below the horizon, [lights, n, 3]."""
    frame = _frame(seen, alpha, f0=(0.5,) * 3)
    x = frame | _half(frame) | _cosines(frame)
    x["cosI"] = x["LdotH"]
    above = np.minimum(*(geometry.dot(seen.N, v) for v in (seen.V, seen.L))) > 0
    product = np.prod([np.broadcast_to(exact_values(k, x), seen.L.shape) for k in keys], axis=0)
    return np.where(above, product, 0.0) * seen.E


def _masked(seen, alpha):
    """Of V, where L is masked by the exact term."""
    cosines = _cosines(_frame(seen, alpha))
    NdotV, NdotL = (cosines[n].astype(float) for n in ("NdotV", "NdotL"))
    rest = exact_values(G1_BECKMANN, {"NdotX": NdotL, "alpha": cosines["alpha"]}) / (4 * NdotV * NdotL)
    x = {"NdotX": cosines["NdotV"], "alpha": cosines["alpha"], "r": np.float32(np.sqrt(2 / np.pi)) * cosines["alpha"]}
    return x, _terms(seen, alpha, D_BECKMANN, SCHLICK) * rest


def _incidence(seen: scenes.Pixels) -> np.ndarray:
    return (np.linalg.norm(seen.V + seen.L, axis=-1, keepdims=True) / 2).astype(np.float32)


def _glass(seen, alpha):
    cosI = _incidence(seen)
    x = {"cosI": cosI, "eta": np.full_like(cosI, 1.5), "f0": np.full_like(cosI, 0.04)}
    return x, _terms(seen, alpha, D_GGX, V_GGX)


def _copper(seen, alpha):
    eta, k = (np.broadcast_to(v[METAL], seen.L.shape) for v in _metals())
    return _conductors(eta, k, _incidence(seen)), _terms(seen, alpha, D_GGX, V_GGX)


METAL = next(i for i, m in enumerate(metals.METALS) if m.name == "copper")


def _clay(seen, alpha):
    return _frame(seen, alpha, albedo=(0.8, 0.5, 0.3), sigma=0.6 * alpha / 0.5, roughness=alpha / 0.5), seen.E


def _highlight(seen, alpha):
    n = 2 / alpha**2 - 2
    s = np.clip(_cosines(_frame(seen, alpha))["NdotH"], 0, 1)
    above = geometry.dot(seen.N, seen.L) > 0
    x = {"s": s, "exponent": np.full_like(s, n), "width": np.full_like(s, np.sqrt(2 / n))}
    return x, np.where(above, seen.E * (n + 2) / (2 * np.pi), 0)


def _environment(seen, alpha):
    """Under a white sky: one light, and the albedo itself."""
    x = {"NdotV": np.clip(geometry.dot(seen.N, seen.V), 0.01, 1)[None]}
    constants = {"alpha": alpha, "perceptual": np.sqrt(alpha), "roughness": alpha / 0.5}
    x |= {n: np.full_like(x["NdotV"], v) for n, v in constants.items()}
    x["albedo"] = np.broadcast_to((0.8, 0.5, 0.3), (*x["alpha"].shape[:2], 3))
    return _rounded(x), np.ones((*x["alpha"].shape[:2], 3))


_LOBE = {"N": "vec3", "V": "vec3", "L": "vec3"}
_HIGHLIGHTS = "directions as in an image: half vectors from the NDF, 30 % of the views at grazing, alpha 0.003..1"
CHARTS = (
    Chart("specular", "specular", "Whole specular lobes",
          _LOBE | {"f0": "vec3", "X": "vec3"} | {n: "float" for n in ("alpha", "perceptual", "exponent", "r", "p")}, GGX,
          f"{_HIGHLIGHTS}; f0 0.04 or a metal's; of anisotropic lobes both widths are alpha, Schlick's p is {ISOTROPY:g}",
          highlights, lambda seen, alpha: (_frame(seen, alpha, f0=(1.0, 0.78, 0.34)), seen.E),
          {"rs": "f0", "T": "X", "alphaX": "alpha", "alphaY": "alpha", "nu": "exponent", "nv": "exponent"}, own=True),
    Chart("fresnel-dielectric", "fresnel", "Fresnel terms of dielectrics",
          {"cosI": "float", "eta": "float", "f0": "float"},
          "lobe_F_dielectric(float,float)", "cosI 0..1, eta 1.2..2.5", _dielectrics, _glass,
          textbook=(("none: F = f0", "f0", "float", ""),)),
    Chart("fresnel-metal", "fresnel", "Fresnel terms of metals",
          {"cosI": "float", "eta0": "float"} | {n: "vec3" for n in ("eta", "k", "f0", "f82", "tint")},
          "lobe_F_conductor(float,vec3,vec3)",           "cosI 0..1, the eleven metals of docs/metals.md", _metal_angles, _copper,
          textbook=(("none: F = f0", "f0", "vec3", ""),)),
    Chart("distribution", "distribution", "GGX distribution of normals, from N and an unnormalised H",
          {"N": "vec3", "H": "vec3", "X": "vec3", "alpha": "float"}, D_GGX, _HIGHLIGHTS,
          lambda n: _half(highlights(n)),
          lambda seen, alpha: (_half(_frame(seen, alpha)), _terms(seen, alpha, V_GGX, SCHLICK)),
          {"NdotH": "dot(N, normalize(H))", "unitH": "normalize(H)"}),
    Chart("gaussian", "gaussian", "Distributions of normals that stand for Beckmann's",
          {"N": "vec3", "H": "vec3", "alpha": "float", "exponent": "float"}, D_BECKMANN,
          "half vectors from Beckmann's distribution, alpha 0.003..0.7; a power's exponent is 2 / alpha^2 - 2", _gaussian_halves,
          lambda seen, alpha: (_half(_frame(seen, alpha)) | {"exponent": _frame(seen, alpha)["exponent"]},
                               _terms(seen, alpha, V_GGX, SCHLICK)),
          {"NdotH": "dot(N, normalize(H))"}),
    Chart("masking-beckmann", "masking", "Smith's masking of Beckmann facets, G1",
          {"NdotX": "float", "alpha": "float", "r": "float"}, G1_BECKMANN,
          "cosine 0.001..1, alpha 0.01..1; Schlick's r is sqrt(2 / pi) alpha", _one_sided, _masked),
    Chart("masking", "masking", "Masking and shadowing over the foreshortening, V = G / (4 NdotV NdotL)",
          {n: "float" for n in (*COSINES, "alpha")}, V_GGX, _HIGHLIGHTS,
          lambda n: _cosines(highlights(n)),
          lambda seen, alpha: (_cosines(_frame(seen, alpha)), _terms(seen, alpha, D_GGX, SCHLICK)),
          textbook=(("implicit: V = 1/4", "0.25", "float", "G = NdotV NdotL"),)),
    Chart("diffuse", "diffuse", "Diffuse lobes",
          _LOBE | {"albedo": "vec3", "sigma": "float", "roughness": "float"}, OREN_NAYAR,
          "cosines 0.01..1, sigma 0..0.6 or roughness 0..1", _diffuse, _clay, own=True),
    Chart("power", "power", "Powers of a cosine", {"s": "float", "exponent": "float", "width": "float"}, POWER,
          "exponent 1..1e4, where the power is 0.01..1", _powers, _highlight, {"NdotH": "s", "h": "exponent"},
          textbook=(("pow", "pow(s, exponent)", "float", ""),
                    ("exp2(n log2 s)", "exp2(exponent * log2(s))", "float", ""))),
    Chart("albedo", "albedo", "Scale and bias of f0 in GGX's albedo (split sum)",
          {"NdotV": "float", "alpha": "float", "perceptual": "float"}, "lobe_DFG_GGX(float,float)",
          "NdotV 0.01..1, alpha 0.01..1", lambda n: _views(n // 8), _environment),
    Chart("albedo-diffuse", "albedo", "Albedo of energy-preserving Oren-Nayar",
          {"NdotV": "float", "albedo": "vec3", "roughness": "float"}, "lobe_albedo_EON(float,vec3,float)",
          "NdotV 0.01..1, roughness 0..1", _views, _environment),
)
NAMES = {c.name: c for c in CHARTS}


def chosen(names: list[str]) -> tuple[Chart, ...]:
    """The charts of families or of single names; all where none is given."""
    for name in names:
        if name not in NAMES and name not in catalogue.FAMILIES:
            known = dict.fromkeys((*catalogue.FAMILIES, *NAMES))
            raise InputError(f"--family {name}: expected one of {', '.join(known)}")
    return tuple(c for c in CHARTS if not names or c.name in names or c.family in names)
