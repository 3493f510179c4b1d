"""Materials of glTF 2 as lobes: what its metallic-roughness model says, without textures."""

from __future__ import annotations

import json
from collections.abc import Callable

import numpy as np

LARGEST = 1e6  # of a factor; most end at 1
SMOOTH = 0.01  # up to this roughness it is an ideal mirror: the lobe ends at alpha = 1e-4
DEFAULT_IOR = 1.5
_READ = {"KHR_materials_ior", "KHR_materials_transmission", "KHR_materials_specular"}

LAMBERT = "lobe_Lambert(vec3,vec3,vec3,vec3)"
GGX = "lobe_GGX(vec3,vec3,vec3,vec3,float)"


def translated(material: dict, warn: Callable[[str], None]) -> dict:
    """
    A material of a glTF file as {"lobes", "mirror", "glass"} of the reference, by glTF 2.0, appendix B:
    f0 = mix(((n - 1) / (n + 1))^2, base, metallic), alpha = roughness^2, and a Lambertian of base (1 - metallic). glTF
    dims that by 1 - F of each pair of directions; here it is the mean of this over the hemisphere, which keeps it
    reciprocal. `warn` hears of everything that is left out.
    """
    extensions = material.get("extensions", {})
    for what in _left_out(material, extensions):
        warn(what)
    pbr = material.get("pbrMetallicRoughness", {})
    base = np.array(pbr.get("baseColorFactor", (1, 1, 1, 1))[:3], float)
    metallic, roughness = float(pbr.get("metallicFactor", 1)), float(pbr.get("roughnessFactor", 1))
    ior = float(extensions.get("KHR_materials_ior", {}).get("ior", DEFAULT_IOR))

    transmission = float(extensions.get("KHR_materials_transmission", {}).get("transmissionFactor", 0))
    specular = extensions.get("KHR_materials_specular", {})
    strength, colour = float(specular.get("specularFactor", 1)), specular.get("specularColorFactor", (1, 1, 1))
    if not all(0 <= x <= LARGEST for x in (*base, metallic, roughness, ior, transmission, strength, *colour)):
        raise ValueError("a factor is out of range")
    if max(*base, metallic, roughness, transmission) > 1:
        warn("factors above 1 are taken for 1")
    base, metallic, roughness = np.minimum(base, 1), min(metallic, 1.0), min(roughness, 1.0)

    if transmission > 0.5 and metallic < 0.5:
        if roughness > SMOOTH or (base < 1).any():
            warn("glass is drawn smooth and clear")
        return {"lobes": [], "mirror": None, "glass": {"eta": ior}}
    if transmission > 0:
        warn("a transmission up to one half, or of a metal, is drawn opaque")

    tint = np.array(colour, float) * strength
    dielectric = np.minimum(((ior - 1) / (ior + 1)) ** 2 * tint, 1)
    f0 = np.clip(dielectric + (base - dielectric) * metallic, 0, 1)
    mean_fresnel = dielectric + (1 - dielectric) / 21  # Schlick's, weighted with the cosine
    albedo = np.clip(base * (1 - metallic) * (1 - mean_fresnel), 0, 1)

    lobes = [(LAMBERT, {"albedo": tuple(albedo)})] if albedo.any() else []
    if roughness <= SMOOTH:
        return {"lobes": lobes, "mirror": {"f0": tuple(f0)}, "glass": None}
    return {"lobes": [*lobes, (GGX, {"f0": tuple(f0), "alpha": (roughness**2,)})], "mirror": None, "glass": None}


def _left_out(material: dict, extensions: dict) -> list[str]:
    """What of a material the reference does not draw."""
    found = []
    if '"index"' in json.dumps(material):
        found.append("textures are left out, the factors alone are drawn")
    if any(material.get("emissiveFactor", ())):
        found.append("it does not shine: put a light there")
    if material.get("alphaMode", "OPAQUE") != "OPAQUE":
        found.append("is drawn opaque")
    if material.get("doubleSided"):
        found.append("doubleSided is left out: all surfaces but glass are black from behind")
    found += [f"{name} is left out" for name in sorted(set(extensions) - _READ)]
    return found
