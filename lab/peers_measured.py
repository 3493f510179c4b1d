"""What peers' functions and ours cost and how wrong they are, by one measure."""

from __future__ import annotations

import re
from dataclasses import asdict, replace

import numpy as np

from . import catalogue, compare, cost, domain, geometry, gl, isa
from . import peers_exact as exactly
from .isa import Call
from .peers import GGX, GIVEN, OURS, Peer, members, ours, rivals, tangent

# Errors.

POINTS, SEED = 1 << 15, 20261
BOUNDED = ("fresnel", "albedo", "power")  # families whose values lie in 0..1: there errors are absolute, else relative
OFF, FIT_OFF, MOST_OFF = 0.01, 0.05, 0.05  # right: off by more than 1 %, a fit by 5 %, at 5 % of the inputs at most


def inputs_of(peer: Peer, count: int = POINTS, seed: int = SEED) -> dict[str, np.ndarray]:
    """Stratified float32 inputs [1, n, width] over the domain, with those of GIVEN that the call takes."""
    inputs = {name: x[None] for name, x in domain.sample(peer.function, count, seed).items()}
    doubles = {name: x.astype(np.float64) for name, x in inputs.items()}
    words = set(re.findall(r"\w+", peer.call)) - inputs.keys()
    return inputs | {name: form(doubles).astype(np.float32) for name, (_, form) in GIVEN.items() if name in words}


def highlights(count: int = POINTS, seed: int = SEED) -> dict[str, np.ndarray]:
    """Inputs of whole GGX lobes as pictures have them: half vectors drawn from the distribution itself, alpha
    logarithmic in 0.003..1, 30 % of the views at grazing (NdotV 0.001..0.1), f0 0.04 or a metal's."""
    rng = np.random.default_rng(seed)
    n = 2 * count
    alpha = 0.003 ** rng.random((n, 1))
    N = geometry.normalize(rng.normal(size=(n, 3)))
    T, u = tangent(N), rng.random((n, 1))
    H = _direction(rng, N, T, 1 / np.sqrt(1 + alpha**2 * u / (1 - u)))
    grazing = rng.random((n, 1)) < 0.3
    V = _direction(rng, N, T, np.where(grazing, 10 ** rng.uniform(-3, -1, (n, 1)), rng.random((n, 1))))
    L = 2 * geometry.dot(V, H) * H - V
    f0 = np.where(rng.random((n, 1)) < 0.5, 0.04, rng.uniform(0.3, 1.0, (n, 3)))
    seen = np.flatnonzero((np.minimum(geometry.dot(N, L), geometry.dot(V, H)) > 1e-4)[:, 0])[:count]
    frames = {"N": N, "V": V, "L": L, "f0": f0, "alpha": alpha, "perceptual": np.sqrt(alpha), "X": T}
    return {name: x[None, seen].astype(np.float32) for name, x in frames.items()}


def _within(peer: Peer, inputs: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Those of the inputs that lie in the limits that the peer keeps to."""
    kept = np.ones(next(iter(inputs.values())).shape[1], bool)
    for name, low, high in peer.narrowed:
        kept &= ((inputs[name][0] >= low) & (inputs[name][0] <= high)).all(-1)
    return {name: x[:, kept] for name, x in inputs.items()}


def _direction(rng, N, T, cosine):
    azimuth, sine = rng.uniform(0, 2 * np.pi, cosine.shape), np.sqrt((1 - cosine) * (1 + cosine))
    return N * cosine + (T * np.cos(azimuth) + np.cross(N, T) * np.sin(azimuth)) * sine


def exact_values(peer: Peer, inputs: dict[str, np.ndarray], term: str = "") -> np.ndarray:
    """What the peer's formula, or the exact term it stands for, is at float32 inputs in double precision, [n, k]."""
    doubles = {p.name: inputs[p.name].astype(np.float64) for p in peer.function.parameters}
    if term:
        return (exactly.power(doubles) if term == "pow" else exactly.evaluated(term, doubles))[0]
    return (peer.exact(doubles) if peer.exact else exactly.evaluated(peer.function.key, doubles))[0]


def error(peer: Peer, context: gl.Context, inputs: dict[str, np.ndarray] | None = None) -> dict:
    """How far a peer's values are from those of its formula, where these are not 0, and where it is farthest; and as
    `approximation`, how far from the exact term that it stands for."""
    inputs = inputs_of(peer) if inputs is None else inputs
    shader = peer.shader()
    with context:
        got = gl.evaluate(context, shader.source, shader.call, shader.result, inputs).astype(np.float64)
    found = _errors(peer, got, exact_values(peer, inputs), inputs)
    if peer.stands_for:
        found["approximation"] = _errors(peer, got, exact_values(peer, inputs, peer.stands_for), inputs)
    return found


def _errors(peer: Peer, got: np.ndarray, exact: np.ndarray, inputs: dict[str, np.ndarray]) -> dict:
    counted = np.abs(exact) > compare.SMALLEST_REFERENCE
    with np.errstate(all="ignore"):
        far = np.abs(got - exact) / (1.0 if peer.family in BOUNDED else np.abs(exact))
    infinite = ~np.isfinite(got)
    far = np.where(counted, np.where(infinite, np.inf, far), 0.0)
    finite = far[counted & ~infinite]
    point, channel = np.unravel_index(np.argmax(far), far.shape)
    worst = {n: x[0, point].tolist() for n, x in inputs.items()}
    off = far[counted] > (FIT_OFF if peer.fit else OFF)
    return {"max": float(finite.max()), "p99": float(np.quantile(finite, 0.99)),
            "rms": float(np.sqrt(np.mean(finite**2))), "off": float(np.mean(off)),
            "nonfinite": int(infinite.any(-1).sum()), "points": int(counted.any(-1).sum()),
            "worst": {"inputs": worst, "got": float(got[point, channel]), "exact": float(exact[point, channel])}}


def white(peer: Peer, context: gl.Context) -> float:
    """The largest share of light that a white diffuse lobe gives back, over views and its shape's range: 1 is all."""
    step = (np.arange(64) + 0.5) / 64
    cosine, u, v, shape = (x.reshape(-1, 1) for x in np.meshgrid([1.0, 0.9, 0.75, 0.5, 0.25, 0.1, 0.03], step, step,
                                                                 np.linspace(0, 1, 7), indexing="ij"))
    L = [np.sqrt(u) * np.cos(2 * np.pi * v), np.sqrt(u) * np.sin(2 * np.pi * v), np.sqrt(1 - u)]  # cosine-distributed
    inputs = {"N": np.broadcast_to([0.0, 0.0, 1.0], (len(u), 3)), "L": np.concatenate(L, -1),
              "V": np.concatenate([np.sqrt(1 - cosine**2), 0 * u, cosine], -1), "albedo": np.ones((len(u), 3))}
    inputs |= {p.name: p.low + shape * (p.high - p.low) for p in peer.function.parameters if p.kind == "float"}
    shader = peer.shader()
    with context:
        got = gl.evaluate(context, shader.source, shader.call, shader.result,
                          {name: x[None].astype(np.float32) for name, x in inputs.items()})
    albedo = np.pi * got[:, 0].astype(np.float64).reshape(7, -1, 7).mean(1)
    return float(albedo.max())


# Guards. Ours keep every finite input finite, and lobes dark below the horizon. To be weighed alike, a peer is given
# those on inputs, and ours are freed of those on divisors, which cannot be put into a peer's function.

_ALPHA, _COLOUR = "clamp({}, 0.0, 1e3)", "max({}, 0.0)"
_TERM_GUARDS = {"alpha": _ALPHA, "alphaX": _ALPHA, "alphaY": _ALPHA, "eta": "clamp({}, 1e-4, 1e4)",
                "k": "clamp({}, 0.0, 1e4)", "exponent": "clamp({}, 0.0, 1e9)", "f0": _COLOUR, "f90": _COLOUR,
                "tint": _COLOUR, "albedo": "clamp({}, 0.0, 1.0)", "roughness": "clamp({}, 0.0, 1.0)"}
_LOBE_GUARDS = _TERM_GUARDS | {"alpha": "max({}, 1e-4)", "f0": "clamp({}, 0.0, 1.0)", "rs": "clamp({}, 0.0, 1.0)",
                               "sigma": "clamp({}, 0.0, 10.0)"}
_FORMED = {"unitH": "vec3 unitH = normalize(H);", "NdotH": "float NdotH = dot(N, normalize(H));",
           "localH": "vec3 h = normalize(H), localH = vec3(dot(h, X), dot(h, cross(N, X)), dot(h, N));"}


def guarded(peer: Peer) -> Peer:
    """The same from our inputs, with our guards on them."""
    is_lobe = {"N", "V", "L"} <= {p.name for p in peer.function.parameters}
    formed = _formed(peer)
    takes = {n: kind for n, kind in peer.parameters.items() if n not in formed}
    takes |= {n: "vec3" for n in "NVL" if is_lobe} | {n: "vec3" for n in "NH" if formed}
    takes |= {"X": "vec3"} if "localH" in formed else {}
    cosines = {n: "clamp({}, -1.0, 1.0)" if n in geometry.SIGNED else "clamp({}, 0.0, 1.0)" for n in takes
               if n in geometry.FORM and takes[n] == "float"}
    guards = (_LOBE_GUARDS if is_lobe else _TERM_GUARDS) | cosines
    lines = [_FORMED[n] for n in formed]
    lines += [f"{n} = {guards[n].format(n)};" for n in takes if n in guards and n not in peer.own]
    if is_lobe:
        lines.append(f"if (min(dot(N, V), dot(N, L)) <= 0.0) return {peer.function.result}(0.0);")
    body = "".join(f"    {line}\n" for line in (*lines, f"return {peer.call};"))
    wrapper = f"{peer.function.result} lobe_guarded({', '.join(f'{t} {n}' for n, t in takes.items())}) {{\n{body}}}\n"
    return replace(peer, call=f"lobe_guarded({', '.join(takes)})", adapter=peer.adapter + wrapper)


def _formed(peer: Peer) -> list[str]:
    """What it takes of our H."""
    return [n for n in _FORMED if n in peer.parameters and peer.function.parameter("H")]


def weighed_alike(peer: Peer) -> Call:
    """With guards on inputs, and none on divisors but a peer's own."""
    if peer.origin != OURS:
        return weighed(guarded(peer))
    call = weighed(peer)
    return replace(call, source=without_divisor_guards(call.source))


def without_divisor_guards(source: str) -> str:
    """The source with (x) for max(x, LOBE_SMALLEST_DIVISOR)."""
    guard = ", LOBE_SMALLEST_DIVISOR)"
    text, *parts = source.split(guard)
    for part in parts:
        start = _opening(text)
        is_max = text[:start].endswith("max")  # else one component of a vec2 is guarded
        text = (f"{text[: start - 3]}{text[start:]})" if is_max else text + guard) + part
    return text


def _opening(text: str) -> int:
    """Where the last parenthesis is that the text leaves open."""
    depth = 0
    for i in range(len(text) - 1, -1, -1):
        depth += {")": 1, "(": -1}.get(text[i], 0)
        if depth < 0:
            return i
    return -1


def without_clamps(source: str) -> str:
    """The source with (x) for clamp(x, low, high)."""
    while start := source.find("clamp(") + 1:
        first = second = start + 4
        depth, commas = 1, []
        while depth:
            second += 1
            depth += {"(": 1, ")": -1}.get(source[second], 0)
            commas += [second] if source[second] == "," and depth == 1 else []
        source = f"{source[: start - 1]}({source[first + 1 : commas[0]]}){source[second + 1 :]}"
    return source


_HORIZON = re.compile(r"\n *if \(min\((?:c\.x, c\.y|dot\(N, V\), dot\(N, L\))\) <= 0\.0\) return vec3\(0\.0\);"
                      r"|(?:\bv > \w+|min\(dot\(N, V\), dot\(N, L\)\) > 0\.0) \? ([^:;]+) : 0\.0")


def without_horizon(source: str) -> str:
    """Our lobes as if no light came from below."""
    return _HORIZON.sub(lambda m: m[1] or "", source)


def weighed(peer: Peer) -> Call:
    """For lab/isa.py."""
    return Call(peer.source, peer.call, peer.function.result, tuple(peer.parameters.items()))


def weighed_grey(peer: Peer) -> Call:
    """A whole GGX lobe of one grey f0, one channel stored, ours without its horizon rule."""
    call = re.sub(r"\bf0\b", "vec3(f0)", peer.call) + ".x"
    return Call(without_horizon(peer.source), call, "float", tuple((peer.parameters | {"f0": "float"}).items()))


# Both, of all.

def measure(gpus: tuple[str, ...] = tuple(isa.GPUS)) -> list[dict]:
    """A row for each peer, and for each of ours that computes or approximates the same: errors and costs.

    Costs are three. `shipped`: the call as it is. `guarded`: weighed_alike. `grey`, of whole GGX lobes: weighed_grey,
    in a compute shader whose inputs come from memory.
    """
    peers, context = members(), gl.create_context("egl")
    everyone = [*{o.function.key: o for p in peers for o in rivals(p)}.values(), *peers]
    rows = [_row(peer, context) for peer in everyone]
    whole = [i for i, p in enumerate(everyone) if p.function.key == GGX]
    for gpu in gpus:
        shipped = isa.costs([weighed(p) for p in everyone], gpu)
        same = isa.costs([weighed_alike(p) for p in everyone], gpu)
        greys = dict(zip(whole, isa.costs([weighed_grey(everyone[i]) for i in whole], gpu, "compute")))
        for i, row in enumerate(rows):
            row["cost"][gpu] = {"shipped": asdict(shipped[i]), "guarded": asdict(same[i])}
            if i in greys:
                row["cost"][gpu]["grey"] = asdict(greys[i])
    return rows


def _row(peer: Peer, context: gl.Context) -> dict:
    asked = guarded(peer) if _formed(peer) else peer  # whoever has H must form what the peer takes of it
    inputs = inputs_of(asked)
    found = error(asked, context, inputs)
    pictured = _within(peer, highlights()) if peer.function.key == GGX else None
    seen = pictured and error(peer, context, pictured)
    beside = {}
    if peer.origin != OURS:
        for rival in rivals(peer):
            same = rival.function.parameters == ours(peer.like).function.parameters  # else its own inputs
            rival = replace(rival, narrowed=peer.narrowed or rival.narrowed) if same else rival
            beside[rival.name] = accuracy({"error": error(rival, context, inputs if same else None),
                                           "highlights": seen and error(rival, context, pictured)})
    return {"origin": peer.origin, "function": peer.name, "stamp": stamp(peer), "family": peer.family,
            "like": peer.function.key,
            "version": peer.package.version if peer.package else "", "call": peer.call, "units": peer.units,
            "setting": list(peer.setting), "formula": peer.formula, "note": peer.note, "stands_for": peer.stands_for,
            "domain": {p.name: [p.low, p.high] for p in peer.function.parameters
                       if p.kind not in ("direction", "half")},
            "error": found, "highlights": seen, "right": (seen or found)["off"] <= MOST_OFF, "beside": beside,
            "white": white(peer, context) if peer.family == "diffuse" else None, "cost": {}}


ROUNDING = 1e-6  # below it two forms are equally accurate
TIE = 1.05  # ratio of costs or errors within which two are level


def stamp(peer: Peer) -> str:
    """A hash of what was measured: of ours the code; of a peer, whose package has its own, what we put around it."""
    (function,) = catalogue.load().find(peer.like)
    around = guarded(peer)
    facts = (peer.label, around.call, around.adapter, peer.factor, peer.setting, peer.narrowed, peer.formula, peer.fit)
    return cost.stamp(catalogue.load(), function, "" if peer.origin == OURS else repr(facts))


def accuracy(row: dict, measure: str = "rms") -> float:
    """The error against the exact term, rms or another of its measures."""
    found = row["highlights"] or row["error"]
    return found.get("approximation", found)[measure]


def cycles(row: dict, gpu: str = "NAVI21", setting: str = "guarded") -> int:
    return row["cost"][gpu][setting]["inverse_throughput"]


def ahead(rows: list[dict], gpu: str = "NAVI21") -> list[tuple[dict, dict, float]]:
    """(peer, ours, rms of ours at the peer's inputs) where a right peer with our guards is cheaper than each of ours
    that is no less accurate there; the cheapest of ours where none is."""
    mine = {row["function"]: row for row in rows if row["origin"] == OURS}
    found = []
    for row in rows:
        if not row["right"] or not row["beside"]:
            continue
        able = [n for n, rms in row["beside"].items() if rms <= max(TIE * accuracy(row), ROUNDING)]
        best = min(able or row["beside"], key=lambda n: cycles(mine[n], gpu))
        if not able or cycles(row, gpu) < cycles(mine[best], gpu):
            found.append((row, mine[best], row["beside"][best]))
    return found
