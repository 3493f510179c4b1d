"""Functions of other libraries beside ours: where they are, what they take, in whose units they answer.

Their code is read from their packages at run time (packages.py) and is no part of this one. What stands here are facts:
names, calls, units. A call is written in our parameter names, and goes through the same door as a user's own shader
(`lobe compare --glsl ... --call ... --against ...`).
"""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache, cached_property, partial

import numpy as np

from . import bundle as bundles
from . import catalogue, geometry, packages
from . import peers_exact as exactly
from .catalogue import Function
from .compare import Shader
from .packages import Package

LYGIA = Package("lygia", "1.4.1", "lygia-1.4.1.tgz",
                "665a21fd2c273c941dd686586027c04b9d4b57ecb52c3c3ef85309583f5bdeff",
                "Prosperity 3.0.0 or Patron", "https://lygia.xyz")
THREE = Package("three", "0.187.0", "three-0.187.0.tgz",
                "ff540832ded0cfe919764d24a3d88f3e2a05f23303f876423e4f893841e90728", "MIT", "https://threejs.org")
MATERIALX = Package("materialx", "1.39.5",
                    "materialx-1.39.5-cp311-cp311-manylinux_2_27_x86_64.manylinux_2_28_x86_64.whl",
                    "027f352adb7788d559b65bcb51b1ac9b0e4f8b23e7341b8e093ac72f8aa1e55f",
                    "Apache 2.0", "https://materialx.org", ("3.11", "manylinux_2_28_x86_64"))
PACKAGES = {"LYGIA": LYGIA, "three.js": THREE, "MaterialX": MATERIALX}
OURS = "lobe"


# Each library as one text; `setting` are `#define` lines, the library's own switches.

@cache
def library(origin: str, setting: tuple[str, ...]) -> str:
    """The preprocessed shading GLSL of a library."""
    return packages.preprocessed(*{"LYGIA": _lygia, "three.js": _three, "MaterialX": _materialx}[origin](setting))


_LYGIA_FILES = re.compile(r"lighting/(common/(ashikhmin|beckmann|charlie|envBRDFApprox|ggx|kelemen|schlick"
                          r"|smithGGXCorrelated)|diffuse/\w+|fresnel|ior/2f0"
                          r"|specular/(phong|blinnPhong|cookTorrance|gaussian|beckmann))\.glsl")


def _lygia(setting):
    texts = packages.texts(LYGIA, ".glsl")
    roots = ["lighting/shadingData/shadingData.glsl", *sorted(filter(_LYGIA_FILES.fullmatch, texts))]
    return "".join(packages.included(texts, root) for root in roots), setting


def _three(setting):
    folder = "src/renderers/shaders/ShaderChunk/"
    scripts = {p: t for p, t in packages.texts(THREE, ".glsl.js").items() if p.startswith(folder)}
    chunks = packages.chunks(scripts)
    roots = ("common", "bsdfs", "lights_physical_pars_fragment")
    return "".join(packages.included(chunks, root) for root in roots), setting


_MATERIALX_FILES = ("stdlib/genglsl/lib/mx_math", *(f"pbrlib/genglsl/lib/mx_{name}" for name in (
    "closure_type", "microfacet", "microfacet_specular", "microfacet_diffuse", "environment_none",
    "transmission_opacity")), "pbrlib/genglsl/mx_generalized_schlick_bsdf")


def _materialx(setting):
    texts, root = packages.texts(MATERIALX, ".glsl"), "MaterialX/libraries/"
    text = packages.joined(texts, [f"{root}{name}.glsl" for name in _MATERIALX_FILES], (f"{root}pbrlib/genglsl",))
    # What MaterialX's generator writes around its files.
    text = "struct BSDF { vec3 response; vec3 throughput; };\n" + packages.tokens_replaced(text, {
        "closureDataConstructor": "ClosureData(closureType, L, V, N, P, occlusion)",
        "texSamplerSignature": "sampler2D tex_sampler", "texSamplerSampler2D": "tex_sampler"})
    return text, ("DIRECTIONAL_ALBEDO_METHOD 0", "AIRY_FRESNEL_ITERATIONS 2", *setting)


# What a peer takes and we do not, from our parameters in double precision. They are inputs of a measurement, so that
# nothing of the conversion is counted.

def tangent(N: np.ndarray) -> np.ndarray:
    """Some unit vector across N."""
    axis = np.where(np.abs(N[..., :1]) < 0.7, [1.0, 0.0, 0.0], [0.0, 1.0, 0.0])
    return geometry.normalize(np.cross(N, axis))


def _local(x):
    N, H, T = x["N"], geometry.normalize(x["H"]), tangent(x["N"])
    return np.concatenate([geometry.dot(H, T), geometry.dot(H, np.cross(N, T)), geometry.dot(H, N)], -1)


GIVEN: dict[str, tuple[str, Callable]] = {
    "perceptual": ("float", lambda x: np.sqrt(x["alpha"])),  # the artist's roughness
    "width": ("float", lambda x: np.sqrt(2.0 / x["exponent"])),  # of a Gaussian that falls like the power
    "unitH": ("vec3", lambda x: geometry.normalize(x["H"])),
    "NdotH": ("float", lambda x: geometry.dot(x["N"], geometry.normalize(x["H"]))),
    "localH": ("vec3", _local),  # the unit half vector in a tangent frame
    "X": ("vec3", lambda x: tangent(x["N"])),
}


@dataclass(frozen=True)
class Peer:
    """One function of another library."""

    origin: str  # a key of PACKAGES, or OURS
    name: str  # as a chart shows it
    family: str  # "" where it belongs to none
    like: str  # the function of ours that computes the same; from it come inputs and domain
    call: str  # in our parameter names and those of GIVEN
    factor: str = ""  # brings its value into our units; not counted as cost
    units: str = ""  # what its value is, where a factor is needed
    setting: tuple[str, ...] = ()  # the library's own switches
    adapter: str = ""  # our GLSL, where an expression does not do
    exact: Callable | None = None  # double precision, from inputs; None: the reference of `like`
    formula: str = ""  # of `exact`
    stands_for: str = ""  # key of the exact term that it approximates on purpose
    narrowed: tuple[tuple[str, float, float], ...] = ()  # parameters with limits of its own: name, low, high
    own: tuple[str, ...] = ()  # parameters that it guards itself as we do
    beside: tuple[str, ...] | None = None  # those of ours that it stands beside; None: `like` and its approximations
    fit: bool = False  # whether it is fitted to an integral: then it is right farther off
    note: str = ""

    @property
    def package(self) -> Package | None:
        return PACKAGES.get(self.origin)

    @property
    def label(self) -> str:
        return f"{self.origin} {self.name}"

    @cached_property
    def source(self) -> str:
        """The GLSL that the call needs, and no more."""
        if self.origin == OURS:
            return bundles.bundle(catalogue.load(), [self.like]) + self.adapter
        code = f"{self.adapter} {self.call} {self.factor}"
        return packages.needed(library(self.origin, self.setting), code) + self.adapter

    @cached_property
    def function(self) -> Function:
        """Ours, with the ranges that the peer itself keeps to."""
        (function,) = catalogue.load().find(self.like)
        limits = {name: {"low": low, "high": high} for name, low, high in self.narrowed}
        return replace(function, parameters=tuple(replace(p, **limits.get(p.name, {})) for p in function.parameters))

    @property
    def parameters(self) -> dict[str, str]:
        """What the call takes: name -> GLSL type, ours first."""
        words = set(re.findall(r"\w+", self.call))
        taken = {p.name: p.type for p in self.function.parameters if p.name in words}
        return taken | {n: kind for n, (kind, _) in GIVEN.items() if n in words and n not in taken}

    def shader(self) -> Shader:
        """For the door of compare: its value in our units."""
        call = f"({self.call}) * ({self.factor})" if self.factor else self.call
        return Shader(self.source, call, self.function.result, self.origin, self.label, self.function.units)


def ours(key: str, family: str = "") -> Peer:
    """A function of the library, in the same shape."""
    library = catalogue.load()
    (function,) = library.find(key)
    stated, types = function.approximation, _types(function)
    term = [f.key for f in library.functions if stated and f.name == stated.name and _types(f) == types]
    same = dict(stands_for="".join(term), fit=bool(stated) and stated.name == catalogue.EXACT)
    if family == "power":  # no function is the exact term, and peers' exponents begin at 1
        limits = tuple((p.name, 1.0, 1e4) for p in function.parameters if p.name in ("exponent", "h"))
        same = dict(stands_for="pow", narrowed=limits)
    return Peer(OURS, library.label(function), family, function.key, function.call, **same)


def _types(function: Function) -> list[str]:
    return [p.type for p in function.parameters]


def members(family: str | None = None) -> list[Peer]:
    """All peers' functions, or those of one family."""
    return [p for p in _TABLE if family in (None, p.family)]


def rivals(peer: Peer) -> list[Peer]:
    """The functions of ours that compute the same from the same inputs, or approximate the same exact term."""
    functions, takes = catalogue.load().functions, _types(peer.function)
    if peer.beside is not None or not peer.family:
        return [ours(f.key, peer.family) for f in functions if f.name in (peer.beside or ())]
    exact = next((f for f in functions if f.key == peer.stands_for), peer.function)
    same = [f for f in functions if _types(f) == takes and exact.name in
            (f.name, f.name.removesuffix("_fast"), f.approximation.name if f.approximation else "")]
    return [ours(f.key, peer.family) for f in same]


# The members. One entry a function, nothing but facts about it.

_L, _T, _M = (partial(Peer, origin) for origin in PACKAGES)
MOBILE, RPI = ("TARGET_MOBILE 1",), ("PLATFORM_RPI 1",)
_EON, _ANISOTROPIC = ("USE_DIFFUSE_ROUGHNESS 1",), ("USE_ANISOTROPY 1",)
_PER_PI, _PER_COSINE = "0.3183098861837907", "(0.3183098861837907 / dot(N, L))"
SCHLICK, SCHLICK_90 = "lobe_F_Schlick(float,vec3)", "lobe_F_Schlick(float,vec3,vec3)"
SCHLICK_1, SCHLICK_90_1 = "lobe_F_Schlick(float,float)", "lobe_F_Schlick(float,float,float)"
D_COSINE, D_VECTORS = "lobe_D_GGX(float,float)", "lobe_D_GGX(vec3,vec3,float)"
D_ANISO, D_BLINN = "lobe_D_GGX_aniso(float,float,float,float,float)", "lobe_D_BlinnPhong(float,float)"
GGX, V_GGX = "lobe_GGX(vec3,vec3,vec3,vec3,float)", "lobe_V_GGX(float,float,float)"
QUALITATIVE, EON = "lobe_OrenNayar_qualitative", "lobe_OrenNayar_EON"
_ALPHA = (("alpha", 0.045**2, 1.0),)  # three.js and LYGIA clamp the artist's roughness to 0.045..1
_TO_1 = (("alpha", 1e-4, 1.0),)
_MODERATE = (("exponent", 1.0, 1e4),)
_EXP2 = dict(exact=exactly.schlick_exp2, formula="f0 + (1 - f0) 2^((-5.55473 c - 6.98316) c)")
_RATIONAL = dict(exact=exactly.power_schlick, formula="c / (n - (n - 1) c)", stands_for="pow",
                 beside=("lobe_pow_Schlick", "lobe_pow_Gaussian"), narrowed=_MODERATE)
_BURLEY = dict(exact=exactly.burley, formula="Burley 2012, section 5.3", factor=_PER_PI, units="pi f", beside=())

# Adapters form what each library's own renderer forms before its call.
_LYGIA_GGX = """
vec3 peer_GGX(vec3 N, vec3 V, vec3 L, vec3 f0, float alpha) {
    vec3 H = normalize(L + V);
    return specularCookTorrance(L, N, H, dot(N, V), clamp(dot(N, L), 0.0, 1.0), clamp(dot(N, H), 0.0, 1.0), alpha, f0);
}
"""
_THREE_GGX = """
vec3 peer_GGX(vec3 N, vec3 V, vec3 L, vec3 f0, float roughness) {
    PhysicalMaterial material;
    material.specularColorBlended = f0;
    material.specularF90 = 1.0;
    material.roughness = roughness;
    return BRDF_GGX(L, V, N, material);
}
"""
_MATERIALX_GGX = """
vec3 peer_GGX(vec3 N, vec3 V, vec3 L, vec3 T, vec3 f0, float alpha) {
    vec3 X = normalize(T - dot(T, N) * N), Y = cross(N, X), H = normalize(L + V);
    float NdotV = clamp(dot(N, V), 1e-8, 1.0), NdotL = clamp(dot(N, L), 1e-8, 1.0), VdotH = clamp(dot(V, H), 1e-8, 1.0);
    float D = mx_ggx_NDF(vec3(dot(H, X), dot(H, Y), dot(H, N)), vec2(alpha));
    return D * mx_fresnel_schlick(VdotH, f0) * mx_ggx_smith_G2(NdotL, NdotV, alpha) / (4.0 * NdotV * NdotL);
}
"""
_MATERIALX_NODE = """
vec3 peer_GGX(vec3 N, vec3 V, vec3 L, vec3 X, vec3 f0, float alpha) {
    BSDF bsdf;
    bsdf.response = bsdf.throughput = vec3(0.0);
    ClosureData closure = ClosureData(1, L, V, N, vec3(0.0), 1.0);
    mx_generalized_schlick_bsdf(closure, 1.0, f0, vec3(1.0), vec3(1.0), 5.0, vec2(alpha), false, 0.0, 1.5, N, X, 0, 0,
                                bsdf);
    return bsdf.response;
}
"""

_TABLE = (
    _L("schlick(vec3,float,float)", "fresnel", SCHLICK, "schlick(f0, 1.0, cosI)", note="with f90 = 1"),
    _L("schlick(vec3,float,float), any f90", "fresnel", SCHLICK_90_1, "schlick(vec3(f0), f90, cosI).x",
       note="gives f0 f90 at normal incidence; its two overloads give f0"),
    _L("schlick(vec3,vec3,float)", "fresnel", SCHLICK_90, "schlick(f0, f90, cosI)"),
    _L("schlick(float,float,float)", "fresnel", SCHLICK_90_1, "schlick(f0, f90, cosI)"),
    _L("fresnel(float,float)", "fresnel", SCHLICK_1, "fresnel(f0, cosI)"),
    _L("fresnel(vec3,float)", "fresnel", SCHLICK, "fresnel(f0, cosI)",
       note="f90 falls below 1 where the mean of f0 is below 0.0202; fresnel(float,float) keeps 1"),
    _L("fresnel(vec3,float), mobile", "fresnel", SCHLICK, "fresnel(f0, cosI)", setting=MOBILE),
    _L("ior2f0(float)", "", "lobe_f0(float)", "ior2f0(eta)"),
    _T("F_Schlick(vec3)", "fresnel", SCHLICK, "F_Schlick(f0, 1.0, cosI)", stands_for=SCHLICK, **_EXP2),
    _T("F_Schlick(float)", "fresnel", SCHLICK_1, "F_Schlick(f0, 1.0, cosI)", stands_for=SCHLICK_1, **_EXP2),
    _M("mx_fresnel_schlick(vec3)", "fresnel", SCHLICK, "mx_fresnel_schlick(cosI, f0)", own=("cosI",)),
    _M("mx_fresnel_schlick(float)", "fresnel", SCHLICK_1, "mx_fresnel_schlick(cosI, f0)", own=("cosI",)),
    _M("mx_fresnel_schlick(vec3,vec3)", "fresnel", SCHLICK_90, "mx_fresnel_schlick(cosI, f0, f90)", own=("cosI",)),
    _M("mx_fresnel_schlick(float,float)", "fresnel", SCHLICK_90_1, "mx_fresnel_schlick(cosI, f0, f90)", own=("cosI",)),
    _M("mx_fresnel_hoffman_schlick", "fresnel", "lobe_F_F82_tint",
       "mx_fresnel_hoffman_schlick(cosI, mx_init_fresnel_schlick(f0, tint, vec3(1.0), 5.0, 0.0, 1.5))", own=("cosI",)),
    _M("mx_fresnel_dielectric", "fresnel", "lobe_F_dielectric", "mx_fresnel_dielectric(cosI, eta)"),
    _M("mx_fresnel_dielectric_polarized", "fresnel", "lobe_F_dielectric_sp",
       "mx_fresnel_dielectric_polarized(cosI, eta).yx"),
    _M("mx_fresnel_conductor", "fresnel", "lobe_F_conductor(float,vec3,vec3)", "mx_fresnel_conductor(cosI, eta, k)"),
    _M("mx_ior_to_f0", "", "lobe_f0(float)", "mx_ior_to_f0(eta)"),
    _M("mx_f0_to_ior", "", "lobe_eta(float)", "mx_f0_to_ior(f0)", own=("f0",), note="clamps f0 to 0.01..0.99"),

    _L("GGX(float,float)", "distribution", D_COSINE, "GGX(NdotH, alpha)", narrowed=_ALPHA),
    _L("GGX(vec3,vec3,float,float)", "distribution", D_VECTORS, "GGX(vec3(0.0), vec3(0.0), NdotH, alpha)",
       narrowed=_ALPHA, note="forms 1 - NdotH^2, and uses its vectors on mobile and WebGL only"),
    _L("GGX(vec3,vec3,float,float), mobile", "distribution", D_VECTORS, "GGX(N, unitH, NdotH, alpha)", setting=MOBILE,
       narrowed=_ALPHA, exact=exactly.capped(D_VECTORS, 65504.0), formula="min(D, 65504)"),
    _L("beckmann", "gaussian", "lobe_D_Beckmann(float,float)", "beckmann(NdotH, alpha)", narrowed=_ALPHA),
    _T("D_GGX", "distribution", D_COSINE, "D_GGX(alpha, NdotH)", narrowed=_ALPHA),
    _T("D_GGX_Anisotropic", "distribution", D_ANISO, "D_GGX_Anisotropic(alphaX, alphaY, NdotH, TdotH, BdotH)",
       setting=_ANISOTROPIC),
    _T("D_BlinnPhong", "distribution", D_BLINN, "D_BlinnPhong(exponent, NdotH)", narrowed=_MODERATE),
    _M("mx_ggx_NDF", "distribution", D_VECTORS, "mx_ggx_NDF(localH, vec2(alpha))", narrowed=_TO_1),
    _M("mx_ggx_NDF, two widths", "distribution", D_ANISO,
       "mx_ggx_NDF(vec3(TdotH, BdotH, NdotH), vec2(alphaX, alphaY))"),

    _L("smithGGXCorrelated", "masking", V_GGX, "smithGGXCorrelated(NdotV, NdotL, alpha)", narrowed=_ALPHA),
    _L("smithGGXCorrelated, mobile", "masking", V_GGX, "smithGGXCorrelated(NdotV, NdotL, alpha)", setting=MOBILE,
       narrowed=_ALPHA, exact=exactly.capped(V_GGX, 65504.0), formula="min(V, 65504)"),
    _L("smithGGXCorrelated_Fast", "masking", "lobe_V_GGX_fast", "smithGGXCorrelated_Fast(NdotV, NdotL, alpha)",
       stands_for=V_GGX),
    _L("kelemen", "masking", "lobe_V_Kelemen(float)", "kelemen(LdotH)"),
    _T("V_GGX_SmithCorrelated", "masking", V_GGX, "V_GGX_SmithCorrelated(alpha, NdotL, NdotV)", narrowed=_ALPHA,
       exact=exactly.capped(V_GGX, 5e5), formula="min(V, 5e5)"),
    _T("V_GGX_SmithCorrelated_Anisotropic", "masking", "lobe_V_GGX_aniso",
       "V_GGX_SmithCorrelated_Anisotropic(alphaX, alphaY, TdotV, BdotV, TdotL, BdotL, NdotV, NdotL)",
       setting=_ANISOTROPIC, exact=exactly.capped("lobe_V_GGX_aniso", 5e5), formula="min(V, 5e5)"),
    _T("G_BlinnPhong_Implicit", "masking", V_GGX, "G_BlinnPhong_Implicit()", exact=exactly.implicit, formula="1/4",
       beside=()),
    _M("mx_ggx_smith_G1", "masking", "lobe_G1_GGX", "mx_ggx_smith_G1(NdotX, alpha)", narrowed=_TO_1),
    _M("mx_ggx_smith_G2", "masking", "lobe_G2_GGX", "mx_ggx_smith_G2(NdotL, NdotV, alpha)", narrowed=_TO_1),

    _L("diffuseLambertConstant", "diffuse", "lobe_Lambert", "albedo * diffuseLambertConstant()", units="f"),
    _L("diffuseLambert", "diffuse", "lobe_Lambert", "albedo * diffuseLambert(L, N)", factor=_PER_COSINE,
       units="pi NdotL f"),
    _L("diffuseOrenNayar", "diffuse", QUALITATIVE,
       "albedo * diffuseOrenNayar(L, N, V, dot(N, V), dot(N, L), sigma)", factor=_PER_COSINE, units="pi NdotL f",
       note="A grows with sigma, where the published one falls"),
    _L("diffuseBurley", "diffuse", EON,
       "albedo * diffuseBurley(dot(N, V), dot(N, L), dot(L, normalize(L + V)), roughness)", **_BURLEY),
    _T("BRDF_Lambert", "diffuse", "lobe_Lambert", "BRDF_Lambert(albedo)"),
    _T("BRDF_EON", "diffuse", EON, "BRDF_EON(L, V, N, albedo, roughness)", setting=_EON),
    _M("mx_oren_nayar_diffuse", "diffuse", QUALITATIVE,
       "albedo * mx_oren_nayar_diffuse(dot(N, V), dot(N, L), dot(L, V), sigma)", factor=_PER_PI, units="pi f"),
    _M("mx_oren_nayar_compensated_diffuse", "diffuse", EON,
       "mx_oren_nayar_compensated_diffuse(dot(N, V), dot(N, L), dot(L, V), roughness, albedo)",
       factor=_PER_PI, units="pi f"),
    _M("mx_burley_diffuse", "diffuse", EON,
       "albedo * mx_burley_diffuse(dot(N, V), dot(N, L), dot(L, normalize(L + V)), roughness)", **_BURLEY),

    _L("powFast", "power", D_BLINN, "powFast(NdotH, exponent)", **_RATIONAL),
    _L("specularBlinnPhong", "power", D_BLINN, "specularBlinnPhong(NdotH, exponent)", exact=exactly.power,
       formula="c^n", narrowed=_MODERATE, beside=()),
    _L("specularBlinnPhong, mobile", "power", D_BLINN, "specularBlinnPhong(NdotH, exponent)", setting=MOBILE,
       **_RATIONAL),
    _L("specularGaussian", "power", D_BLINN, "specularGaussian(NdotH, width)", exact=exactly.gaussian,
       formula="exp(-(theta / width)^2)", stands_for="pow", narrowed=_MODERATE, beside=(),
       note="costs more than the pow that it stands for"),

    _L("specularPhong", "specular", "lobe_Phong_1975", "rs * specularPhong(L, N, V, exponent)",
       factor="(1.0 / dot(N, L))", units="NdotL f", narrowed=_MODERATE),
    _L("specularCookTorrance", "specular", GGX, "peer_GGX(N, V, L, f0, alpha)", adapter=_LYGIA_GGX, narrowed=_ALPHA,
       note="with fresnel(vec3,float), whose f90 falls below 1 for a small f0"),
    _L("specularCookTorrance, mobile", "specular", GGX, "peer_GGX(N, V, L, f0, alpha)", setting=MOBILE,
       adapter=_LYGIA_GGX, narrowed=_ALPHA, stands_for=GGX, exact=exactly.ggx_with(exactly.capped_over_smith),
       formula="with V not above 65504"),
    _L("specularCookTorrance, Raspberry Pi", "specular", GGX, "peer_GGX(N, V, L, f0, alpha)", setting=RPI,
       adapter=_LYGIA_GGX, narrowed=_ALPHA, stands_for=GGX, exact=exactly.ggx_with(exactly.fast_over_smith),
       formula="with Hammon's masking"),
    _T("BRDF_GGX", "specular", GGX, "peer_GGX(N, V, L, f0, perceptual)", adapter=_THREE_GGX, narrowed=_ALPHA,
       stands_for=GGX, exact=exactly.ggx_with(exactly.exp2_over_schlick), formula="with Schlick's term by exp2"),
    _T("BRDF_BlinnPhong", "specular", "lobe_BlinnPhong", "BRDF_BlinnPhong(L, V, N, rs, exponent)",
       exact=exactly.implicit_blinn_phong, formula="D F / 4", narrowed=_MODERATE, beside=()),
    _M("NDF, Schlick, G2", "specular", GGX, "peer_GGX(N, V, L, X, f0, alpha)", adapter=_MATERIALX_GGX, narrowed=_TO_1,
       note="its terms, put together as its nodes do, without their compensation of energy"),
    _M("mx_generalized_schlick_bsdf", "specular", GGX, "peer_GGX(N, V, L, X, f0, alpha)", factor="(1.0 / dot(N, L))",
       units="NdotL f", adapter=_MATERIALX_NODE, narrowed=(("alpha", 0.01, 1.0),), exact=exactly.compensated_ggx,
       formula="lobe_GGX (1 + F (1 - E) / E)", beside=(), fit=True),

    _L("envBRDFApprox", "albedo", "lobe_DFG_GGX", "envBRDFApprox(NdotV, perceptual)", fit=True),
    _T("EON_DirectionalAlbedo", "albedo", "lobe_albedo_EON", "EON_DirectionalAlbedo(albedo, roughness, NdotV)",
       setting=_EON),
    _M("mx_ggx_dir_albedo_analytic", "albedo", "lobe_DFG_GGX",
       "mx_ggx_dir_albedo_analytic(NdotV, alpha, vec3(1.0, 0.0, 0.0), vec3(0.0, 1.0, 0.0)).xy", fit=True),
    _M("mx_ggx_dir_albedo, white", "albedo", "lobe_albedo_GGX", "mx_ggx_dir_albedo(NdotV, alpha, 1.0, 1.0)",
       fit=True),
    _M("mx_ggx_energy_compensation", "albedo", "lobe_energy_Turquin", "mx_ggx_energy_compensation(NdotV, alpha, f0)",
       fit=True),
    _M("mx_oren_nayar_compensated_diffuse_dir_albedo", "albedo", "lobe_albedo_EON",
       "mx_oren_nayar_compensated_diffuse_dir_albedo(NdotV, roughness, albedo)"),
)
