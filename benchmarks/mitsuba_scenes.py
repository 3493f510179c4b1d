"""Three scenes in the words of two renderers: Lobe's reference and Mitsuba 3 (LLVM). Same camera, light, box filter.

Where both know a thing by another name or another convention, this file says so; whatever is not said is equal.
"""

from __future__ import annotations

import glob
import os
import tempfile
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from lobe import reference
from lobe.lab import probes, scenes

EYE, TARGET, UP, FOV_Y = scenes.EYE, scenes.TARGET, scenes.UP, 24.0
LAMBERT = "lobe_Lambert(vec3,vec3,vec3,vec3)"
CONDUCTOR = "lobe_GGX_conductor(vec3,vec3,vec3,vec3,vec3,float)"
GOLD = {"eta": (0.027145, 0.49583, 1.4770), "k": (3.1310, 2.2504, 1.7784), "alpha": 0.2}
ROULETTE = 5  # interactions of a path before chance may end it, in both


def load_mitsuba(threads: int):
    """Mitsuba's module, ready to render on the CPU. Debian hides LLVM's library from it; and it keeps compiled kernels
    at home, which here is a new one, so that each run compiles its own."""
    global _home
    _home = tempfile.TemporaryDirectory()  # until the program ends
    os.environ["HOME"] = _home.name
    found = sorted(glob.glob("/usr/lib/*/libLLVM.so.*") + glob.glob("/usr/lib/llvm-1[6-9]/lib/libLLVM*.so*"))
    if found:
        os.environ.setdefault("DRJIT_LIBLLVM_PATH", found[-1])
    import drjit
    import mitsuba

    mitsuba.set_variant("llvm_ad_rgb")
    drjit.set_thread_count(threads)
    mitsuba.register_bsdf("correlated", lambda properties: _correlated(mitsuba, drjit)(properties))
    return mitsuba


@dataclass(frozen=True)
class Pair:
    """One scene: `lobe` returns the reference's scene and camera, `mitsuba` the dictionary of the other's scene.

    depth   surface interactions of the longest path; Mitsuba counts the edges of a path, one more
    native  a dictionary where Mitsuba's own material, the nearest that it has, differs; None where it does not
    """

    name: str
    depth: int
    lobe: Callable
    mitsuba: Callable
    native: Callable | None = None


# --- box: a bunny in a diffuse box under a square lamp ----------------------------------------------------------------

WHITE, RED, GREEN, CLAY = (0.7, 0.7, 0.7), (0.6, 0.06, 0.05), (0.12, 0.45, 0.1), (0.6, 0.45, 0.35)
LAMP = {"center": (0.0, 0.99, 0.0), "half_u": (0.35, 0.0, 0.0), "half_v": (0.0, 0.0, 0.35),
        "radiance": (16.0, 13.0, 9.0)}
WALLS = (  # centre, normal, albedo; squares of half size 1
    ((0, -1, 0), (0, 1, 0), WHITE), ((0, 1, 0), (0, -1, 0), WHITE), ((0, 0, -1), (0, 0, 1), WHITE),
    ((-1, 0, 0), (1, 0, 0), RED), ((1, 0, 0), (-1, 0, 0), GREEN))
BOX_VIEW = ((0.0, 0.0, 5.4), (0.0, 0.0, 0.0), (0.0, 1.0, 0.0), 26.0)


def _bunny():
    mesh = scenes.load_mesh(scenes.SHAPES["bunny"])
    vertices = mesh.vertices * 0.6
    return vertices + (0.1, -1 - vertices[:, 1].min(), 0.0), mesh.faces


def _box_lobe():
    scene = reference.Scene()
    scene.set_material(scene.add_mesh(*_bunny()), [(LAMBERT, {"albedo": CLAY})])
    for center, normal, albedo in WALLS:
        scene.set_material(scene.add_plane(center, normal, 1.0), [(LAMBERT, {"albedo": albedo})])
    scene.add_rectangle_light(**LAMP)
    return scene, reference.Camera(*BOX_VIEW)


def _box_mitsuba(mi, size: int) -> dict:
    vertices, faces = _bunny()
    walls = {f"wall{i}": {"type": "rectangle", "to_world": _square(mi, center, normal), "bsdf": _diffuse(albedo)}
             for i, (center, normal, albedo) in enumerate(WALLS)}
    u, v = (np.array(LAMP[k]) for k in ("half_u", "half_v"))
    lamp = {"type": "rectangle", "to_world": _frame(mi, u, v, LAMP["center"]), "bsdf": _diffuse((0, 0, 0)),
            "emitter": {"type": "area", "radiance": {"type": "rgb", "value": list(LAMP["radiance"])}}}
    return _scene(mi, size, BOX_VIEW, 6) | walls | {"lamp": lamp, "bunny": _mesh(mi, vertices, faces, _diffuse(CLAY))}


# --- gold: a rough conductor in a probe -------------------------------------------------------------------------------


def _probe() -> np.ndarray:
    return probes.load(scenes.RIGS["lobby"].probe).astype(np.float32)


def _gold_lobe(metal: dict = GOLD):
    scene, mesh = reference.Scene(), scenes.load_mesh(scenes.SHAPES["teapot"])
    scene.set_material(scene.add_mesh(mesh.vertices, mesh.faces, normals=mesh.normals), [(CONDUCTOR, metal)])
    scene.set_environment(_probe())
    return scene, reference.Camera(EYE, TARGET, UP, FOV_Y)


def _gold_mitsuba(mi, size: int, metal: dict = GOLD, kind: str = "correlated") -> dict:
    mesh = scenes.load_mesh(scenes.SHAPES["teapot"])
    bsdf = {"type": kind, "distribution": "ggx", "alpha": metal["alpha"]}
    bsdf |= {name: {"type": "rgb", "value": list(metal[name])} for name in ("eta", "k")}
    return _scene(mi, size, (EYE, TARGET, UP, FOV_Y), 3) | {
        "probe": _environment(mi), "teapot": _mesh(mi, mesh.vertices, mesh.faces, bsdf)}


def _gold(name: str, metal: dict) -> Pair:
    return Pair(name, 3, lambda: _gold_lobe(metal), lambda mi, size: _gold_mitsuba(mi, size, metal),
                lambda mi, size: _gold_mitsuba(mi, size, metal, "roughconductor"))


# --- glass: a ball of it on diffuse ground, in a probe ----------------------------------------------------------------

GLASS_ETA, BALL, GROUND = 1.5, 0.8, 3.0
GREY = (0.5, 0.5, 0.5)


def _glass_lobe():
    scene = reference.Scene()
    scene.set_material(scene.add_sphere((0, 0, 0), BALL), [], glass={"eta": GLASS_ETA})
    scene.set_material(scene.add_plane((0, -BALL, 0), (0, 1, 0), GROUND), [(LAMBERT, {"albedo": GREY})])
    scene.set_environment(_probe())
    return scene, reference.Camera(EYE, TARGET, UP, FOV_Y)


def _glass_mitsuba(mi, size: int) -> dict:
    glass = {"type": "dielectric", "int_ior": GLASS_ETA, "ext_ior": 1.0}
    ground = _square(mi, (0, -BALL, 0), (0, 1, 0), GROUND)
    return _scene(mi, size, (EYE, TARGET, UP, FOV_Y), 8) | {
        "probe": _environment(mi),
        "ball": {"type": "sphere", "radius": BALL, "bsdf": glass},
        "ground": {"type": "rectangle", "to_world": ground, "bsdf": _diffuse(GREY)}}


PAIRS = {pair.name: pair for pair in (
    Pair("box", 6, _box_lobe, _box_mitsuba),
    _gold("gold", GOLD),
    Pair("glass", 8, _glass_lobe, _glass_mitsuba),
)}
ROUGH = _gold("rough gold", GOLD | {"alpha": 0.7})  # where the correlation of masking and shadowing is seen


# --- Mitsuba's words --------------------------------------------------------------------------------------------------


def _scene(mi, size: int, view, depth: int) -> dict:
    eye, target, up, angle = view
    return {
        "type": "scene",
        "integrator": {"type": "path", "max_depth": depth + 1, "rr_depth": ROULETTE + 1},
        "sensor": {"type": "perspective", "fov_axis": "y", "fov": angle, "near_clip": 0.01, "far_clip": 1000.0,
                   "to_world": mi.ScalarTransform4f().look_at(eye, target, up),
                   "sampler": {"type": "independent"},
                   "film": {"type": "hdrfilm", "width": size, "height": size, "pixel_format": "rgb",
                            "component_format": "float32", "rfilter": {"type": "box"}}},
    }


def _diffuse(albedo) -> dict:
    return {"type": "diffuse", "reflectance": {"type": "rgb", "value": list(map(float, albedo))}}


def _frame(mi, u, v, center):
    """Where Mitsuba's square -1..1 with normal +z goes."""
    matrix = np.eye(4)
    normal = np.cross(u, v)
    matrix[:3] = np.stack([u, v, normal / np.linalg.norm(normal), center], axis=1)
    return mi.ScalarTransform4f(matrix)


def _square(mi, center, normal, half: float = 1.0):
    normal = np.array(normal, float)
    u = np.roll(normal, 1)
    return _frame(mi, half * u, half * np.cross(normal, u), center)


def _mesh(mi, vertices, faces, bsdf: dict):
    """With the normals that the reference gives it."""
    built = reference.Scene()
    built.add_mesh(vertices, faces, normals=None)
    properties = mi.Properties()
    properties["bsdf"] = mi.load_dict(bsdf)
    mesh = mi.Mesh("mesh", len(vertices), len(faces), has_vertex_normals=True, props=properties)
    parameters = mi.traverse(mesh)
    parameters["vertex_positions"] = np.ravel(vertices).astype(np.float32)
    parameters["vertex_normals"] = np.ravel(built.normals(0)).astype(np.float32)
    parameters["faces"] = np.ravel(faces).astype(np.uint32)
    parameters.update()
    return mesh


def _environment(mi) -> dict:
    """The probe, bilinear between the centres of its texels. Mitsuba's rows lie on the poles and its columns half a
    step aside, so that the same function is given to it on a grid of half the step, which holds all its kinks."""
    pixels = _probe().astype(float)
    height, width = pixels.shape[:2]
    rows = pixels[np.clip(np.arange(-1, height + 1), 0, height - 1)]
    fine = np.empty((2 * height + 1, width, 3))
    fine[0::2], fine[1::2] = (rows[:-1] + rows[1:]) / 2, pixels
    columns = np.empty((2 * height + 1, 2 * width, 3))
    columns[:, 0::2], columns[:, 1::2] = (np.roll(fine, 1, axis=1) + fine) / 2, fine
    turned = mi.ScalarTransform4f().rotate([0, 1, 0], 180 + 180 / (2 * width))
    return {"type": "envmap", "bitmap": mi.Bitmap(columns.astype(np.float32)), "to_world": turned}


def _correlated(mi, dr):
    """Mitsuba's rough conductor with masking and shadowing correlated through height, as in Lobe's lobes: its own takes
    them for independent. A factor on its values; all else, its sampling too, is its own."""

    class Correlated(mi.BSDF):
        def __init__(self, properties):
            mi.BSDF.__init__(self, properties)
            self.alpha = properties["alpha"]
            self.nested = mi.load_dict({"type": "roughconductor", "distribution": properties["distribution"],
                                        "alpha": self.alpha, "eta": properties["eta"], "k": properties["k"]})
            self.m_components = [self.nested.flags(0)]
            self.m_flags = self.nested.flags()

        def factor(self, wi, wo):
            def masked(w):  # Smith's Lambda of GGX
                return 0.5 * (dr.sqrt(1 + self.alpha**2 * mi.Frame3f.tan_theta_2(w)) - 1)

            V, L = masked(wi), masked(wo)
            return (1 + V) * (1 + L) / (1 + V + L)

        def sample(self, context, si, sample1, sample2, active=True):
            sampled, weight = self.nested.sample(context, si, sample1, sample2, active)
            return sampled, weight * dr.select(active, self.factor(si.wi, sampled.wo), 0)

        def eval(self, context, si, wo, active=True):
            return self.nested.eval(context, si, wo, active) * self.factor(si.wi, wo)

        def pdf(self, context, si, wo, active=True):
            return self.nested.pdf(context, si, wo, active)

        def eval_pdf(self, context, si, wo, active=True):
            value, pdf = self.nested.eval_pdf(context, si, wo, active)
            return value * self.factor(si.wi, wo), pdf

        def to_string(self):
            return f"Correlated[{self.nested}]"

    return Correlated
