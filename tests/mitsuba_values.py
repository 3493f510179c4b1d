"""Mitsuba's values of what it and Lobe both have: python mitsuba_values.py INPUTS.npz OUTPUTS.npz.

A program of its own, since Mitsuba and Mesa load two LLVMs, which one process does not bear.
"""

import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "benchmarks"))

import mitsuba_scenes  # noqa: E402


def main(inputs, outputs):
    mi = mitsuba_scenes.load_mitsuba(threads=2)
    given = {name: values.astype(np.float32) for name, values in np.load(inputs).items()}

    def vectors(name):
        return mi.Vector3f(*given[name].T.copy())

    def local(bsdf):
        """A material's values for V and L about N = (0, 0, 1), the cosine in, and the density of its sampling."""
        material, at = mi.load_dict(bsdf), mi.SurfaceInteraction3f()
        at.wi, at.wavelengths, at.sh_frame = vectors("V"), [], mi.Frame3f(mi.Normal3f(0, 0, 1))
        at.t = 1.0  # valid
        context = mi.BSDFContext()
        values = np.array(material.eval(context, at, vectors("L")))
        return (values if values.shape[-1] == 3 else values.T), np.array(material.pdf(context, at, vectors("L")))

    cosine = mi.Float(given["cosine"])
    found = {"F_dielectric": mi.fresnel(cosine, mi.Float(given["eta"]))[0],
             "F_conductor": mi.fresnel_conductor(cosine, mi.Complex2f(mi.Float(given["eta"]), mi.Float(given["k"])))}
    for name, kind in (("GGX", mi.MicrofacetType.GGX), ("Beckmann", mi.MicrofacetType.Beckmann)):
        facets = mi.MicrofacetDistribution(kind, mi.Float(given["alphaX"]), mi.Float(given["alphaY"]))
        found[f"D_{name}_aniso"] = facets.eval(vectors("H"))
        even = mi.MicrofacetDistribution(kind, mi.Float(given["alphaX"]))
        found[f"G1_{name}"] = even.smith_g1(vectors("V"), mi.Vector3f(0, 0, 1))
    gold = {name: {"type": "rgb", "value": list(map(float, mitsuba_scenes.GOLD[name]))} for name in ("eta", "k")}
    for name, facets in (("GGX", "ggx"), ("Beckmann", "beckmann")):
        conductor = {"type": "roughconductor", "distribution": facets, "alpha": mitsuba_scenes.GOLD["alpha"], **gold}
        found[f"{name}_conductor"], density = local(conductor)
        if name == "GGX":
            found["pdf_GGX"] = density
    found["GGX_correlated"], _ = local({"type": "correlated", "distribution": "ggx",
                                        "alpha": mitsuba_scenes.GOLD["alpha"], **gold})
    glass = {"type": "roughdielectric", "distribution": "ggx", "alpha": mitsuba_scenes.GOLD["alpha"],
             "int_ior": mitsuba_scenes.GLASS_ETA, "ext_ior": 1.0}
    found["GGX_dielectric"], _ = local(glass)
    found["Lambert"], _ = local({"type": "diffuse", "reflectance": {"type": "rgb", "value": list(mitsuba_scenes.CLAY)}})
    np.savez(outputs, **{name: np.array(values) for name, values in found.items()})


if __name__ == "__main__":
    main(*sys.argv[1:])
