"""The passes of examples/, drawn offscreen: python -m lobe.lab.examples writes the pictures of examples/README.md."""

from __future__ import annotations

import re
from dataclasses import dataclass

import numpy as np

from lobe import reference

from . import bundle, catalogue, files, gl, meshes, pictures, probes, raster, scenes
from .paths import DATA, ROOT

FOLDER = ROOT / "examples"
FIGURES = ROOT / "docs" / "figures"
SUN = scenes.Light("directional", (0.5, 0.8, 0.9), (2.6, 2.5, 2.3))
LAMP = scenes.Light("point", (-2.2, 1.0, 2.0), (4.0, 5.0, 7.5))
SURFACE = {"baseColor": (0.6, 0.12, 0.06), "metallic": 0.0, "roughness": 0.3}
GOLD = {"baseColor": (1.0, 0.7284, 0.3646), "metallic": 1.0, "roughness": 0.25}
BRUSHED = {"roughnessAlong": 0.4, "roughnessAcross": 0.75}
LAST_LEVEL = 4  # of the prefiltered probe, whose levels have the roughnesses 0, 1/4 .. 1
EXPOSURE = 0.5  # of the picture with the probe


def complete(name: str, target: str = "330") -> str:
    """A file of examples/ with what its first line puts in front, for one of bundle.TARGETS."""
    text = (FOLDER / name).read_text(encoding="utf-8")
    command = re.match(r"// \./lobe bundle (.+) --target 330 ", text)
    front = bundle.bundle(catalogue.load(), command[1].split(), target) if command else bundle.TARGETS[target]
    return front + text


@dataclass(frozen=True)
class Drawn:
    """What a pass has drawn: its targets and its depth, as textures."""

    targets: list  # moderngl.Texture
    depth: object  # moderngl.Texture

    @property
    def image(self) -> np.ndarray:
        """The first target, [h, w, 4] float32 linear RGB and coverage, row 0 on top."""
        return texels(self.targets[0])[::-1]


def texels(texture) -> np.ndarray:
    """A float32 RGBA texture as [h, w, 4], its first row first."""
    return np.frombuffer(texture.read(), np.float32).reshape(texture.height, texture.width, 4)


def draw(context: gl.Context, fragment: str, mesh: meshes.Mesh | None, size: tuple[int, int], uniforms: dict,
         targets: int = 1) -> Drawn:
    """One pass of a mesh, or of the whole screen where it is None, into float32 targets cleared to 0.

    fragment   name of a file in examples/
    size       (width, height) of the targets
    uniforms   name -> number, tuple, or texture; those that the pass does not have are left out
    """
    device = context.gl
    shader = gl.program(context, complete("mesh.vert" if mesh else "screen.vert"), complete(fragment))
    units = 0
    for name in uniforms.keys() & set(shader):
        value = uniforms[name]
        if hasattr(value, "use"):
            value.use(units)
            value, units = units, units + 1
        shader[name].value = value
    drawn = Drawn([device.texture(size, 4, dtype="f4") for _ in range(targets)], device.depth_texture(size))
    drawn.depth.compare_func = ""  # to be read as numbers
    frame = device.framebuffer(drawn.targets, drawn.depth)
    frame.use()
    frame.clear(0.0, 0.0, 0.0, 0.0, depth=1.0)
    if mesh is None:
        device.vertex_array(shader, []).render(mode=device.TRIANGLES, vertices=3)
    else:
        device.enable(device.DEPTH_TEST)
        _vertices(device, shader, mesh).render()
        device.disable(device.DEPTH_TEST)
    return drawn


def _vertices(device, shader, mesh: meshes.Mesh):
    built = reference.Scene()
    built.add_mesh(mesh.vertices, mesh.faces, normals=mesh.normals, uv=mesh.uv)
    attributes = {"position": mesh.vertices, "normal": built.normals(0), "tangent": built.tangents(0)}
    buffers = [(device.buffer(values.astype("f4").tobytes()), "3f", name)
               for name, values in attributes.items() if name in shader]
    return device.vertex_array(shader, buffers, device.buffer(mesh.faces.astype("u4").tobytes()))


def lit(sun: scenes.Light = SUN, lamp: scenes.Light = LAMP) -> dict:
    """The uniforms of camera and lights."""
    view = raster.projection()
    direction = np.array(sun.vector) / np.linalg.norm(sun.vector)
    return {"eye": scenes.EYE, "viewProjection": tuple(view.T.ravel()),
            "inverseViewProjection": tuple(np.linalg.inv(view).T.ravel()), "sunDirection": tuple(direction),
            "sunColor": sun.color, "lampPosition": lamp.vector, "lampColor": lamp.color}


def forward(context: gl.Context, mesh: meshes.Mesh, size: int, surface: dict = SURFACE) -> np.ndarray:
    """[size, size, 4], as the others below: linear RGB and coverage."""
    return draw(context, "forward.frag", mesh, (size, size), lit() | surface).image


def deferred(context: gl.Context, mesh: meshes.Mesh, size: int, surface: dict = SURFACE) -> np.ndarray:
    first = draw(context, "deferred-geometry.frag", mesh, (size, size), lit() | surface, targets=2)
    buffers = {"normalRoughness": first.targets[0], "baseMetallic": first.targets[1], "depth": first.depth}
    return draw(context, "deferred-lighting.frag", None, (size, size), lit() | buffers).image


def brushed(context: gl.Context, mesh: meshes.Mesh, size: int, surface: dict = BRUSHED, sun: scenes.Light = SUN,
            lamp: scenes.Light = LAMP) -> np.ndarray:
    return draw(context, "brushed.frag", mesh, (size, size), lit(sun, lamp) | surface).image


def prefiltered(context: gl.Context, radiance: np.ndarray, samples: int = 256) -> dict:
    """The uniforms of a probe [h, w, 3], latitude-longitude and linear: what probe-prefilter.frag makes of it."""
    height, width = radiance.shape[:2]
    source = _probe(context, radiance)

    def level(shape, **uniforms):
        drawn = draw(context, "probe-prefilter.frag", None, shape, {"radiance": source, "samples": samples} | uniforms)
        return texels(drawn.targets[0])

    probe = _probe(context, radiance)  # level 0 is the mirror
    for i in range(1, LAST_LEVEL + 1):
        values = level((width >> i, height >> i), alpha=(i / LAST_LEVEL) ** 2, diffuse=False)
        probe.write(values.astype("f2").tobytes(), level=i)
    diffuse = level((width >> LAST_LEVEL, height >> LAST_LEVEL), alpha=1.0, diffuse=True)
    return {"probe": probe, "lastLevel": float(LAST_LEVEL), "irradiance": _probe(context, diffuse)}


def _probe(context: gl.Context, values: np.ndarray):
    device = context.gl
    height, width = values.shape[:2]
    half = np.ones((height, width, 4), np.float16)
    half[..., :3] = values[..., :3]
    texture = device.texture((width, height), 4, half.tobytes(), dtype="f2")
    texture.build_mipmaps()
    texture.filter = (device.LINEAR_MIPMAP_LINEAR, device.LINEAR)
    texture.repeat_x, texture.repeat_y = True, False
    return texture


def probe_shading(context: gl.Context, mesh: meshes.Mesh, size: int, probe: dict, surface: dict = GOLD) -> np.ndarray:
    return draw(context, "probe-shading.frag", mesh, (size, size), lit() | probe | surface).image


def lobby() -> np.ndarray:
    """The probe of the pictures, [256, 512, 3]."""
    return probes.load(DATA / "hdri" / "lobby.exr")


def shown(image: np.ndarray, fine: int = 3) -> np.ndarray:
    """A picture for the page: each `fine` x `fine` pixels averaged as the display shows them, over a light grey."""
    colour = pictures.srgb(image[..., :3]) * image[..., 3:] + (1 - image[..., 3:]) * np.array(pictures.BACKGROUND) / 255
    height, width = (n // fine for n in image.shape[:2])
    return colour.reshape(height, fine, width, fine, 3).mean((1, 3))


def main(size: int = 320) -> None:
    context = gl.create_context("egl")
    suzanne, teapot = (scenes.load_mesh(scenes.SHAPES[name]) for name in ("suzanne", "teapot"))
    with context:
        images = {
            "forward": forward(context, suzanne, 3 * size),
            "deferred": deferred(context, suzanne, 3 * size),
            "probe": probe_shading(context, suzanne, 3 * size, prefiltered(context, EXPOSURE * lobby())),
            "brushed": brushed(context, teapot, 3 * size),
        }
    for name, image in images.items():
        files.write_png(FIGURES / f"example-{name}.png", shown(image))


if __name__ == "__main__":
    main()
