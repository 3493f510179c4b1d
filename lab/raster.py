"""A mesh drawn by OpenGL itself, for the comparison of whole frames."""

from __future__ import annotations

import numpy as np

from . import gl, scenes

VERTEX = """#version 330
uniform mat4 lobe_projection;
in vec3 lobe_position;
in vec3 lobe_normal;
in vec3 lobe_tangent;
out vec3 lobe_P;
out vec3 lobe_N;
out vec3 lobe_T;
void main() {
    lobe_P = lobe_position;
    lobe_N = lobe_normal;
    lobe_T = lobe_tangent;
    gl_Position = lobe_projection * vec4(lobe_position, 1.0);
}
"""


def draw(context: gl.Context, scene: scenes.Scene, size: int, source: str, call: str, result: str,
         parameters: dict[str, tuple[float, ...]]) -> tuple[np.ndarray, np.ndarray]:
    """The scene's mesh shaded by a lobe under the scene's lights, without shadows.

    Returns the linear picture [size, size, 3] float32, row 0 on top, and the triangle at each pixel's centre
    [size, size] int32, -1 where there is none.
    """
    device = context.gl
    shader = gl.program(context, VERTEX, _fragment(scene, source, call, result, parameters))
    shader["lobe_projection"].write(projection().T.astype("f4").tobytes())
    if "lobe_eye" in shader:
        shader["lobe_eye"].value = scenes.EYE
    built, _ = scenes.build(scene)
    mesh = scenes.load_mesh(scene.mesh)
    attributes = {"lobe_position": mesh.vertices, "lobe_normal": built.normals(0), "lobe_tangent": built.tangents(0)}
    buffers = {name: device.buffer(values.astype("f4").tobytes()) for name, values in attributes.items() if name in shader}
    indices = device.buffer(mesh.faces.astype("u4").tobytes())
    array = device.vertex_array(shader, [(b, "3f", name) for name, b in buffers.items()], indices)
    color, primitive = device.texture((size, size), 4, dtype="f4"), device.texture((size, size), 1, dtype="i4")
    depth = device.depth_renderbuffer((size, size))
    frame = device.framebuffer([color, primitive], depth)
    frame.use()
    device.viewport = (0, 0, size, size)
    frame.clear(0.0, 0.0, 0.0, 0.0, depth=1.0)
    device.enable(device.DEPTH_TEST)
    array.render()
    device.disable(device.DEPTH_TEST)
    image = np.frombuffer(color.read(), np.float32).reshape(size, size, 4)[::-1]
    # Cleared to 0, and triangle i is written as i + 1.
    triangle = np.frombuffer(primitive.read(), np.int32).reshape(size, size)[::-1] - 1
    for thing in (array, frame, color, primitive, depth, indices, shader, *buffers.values()):
        thing.release()
    return image[..., :3].copy(), triangle.copy()


def projection(eye=scenes.EYE, target=scenes.TARGET, fov: float = scenes.FOV_Y, aspect: float = 1.0,
               near: float = 0.1, far: float = 100.0) -> np.ndarray:
    """World to clip space for a camera that sees `fov` degrees between lower and upper edge; that of the scenes if no
    other is given. `aspect` is width over height."""
    eye, target, up = (np.array(v, float) for v in (eye, target, scenes.UP))
    back = (eye - target) / np.linalg.norm(eye - target)
    right = np.cross(up, back)
    right /= np.linalg.norm(right)
    view = np.eye(4)
    view[:3, :3] = right, np.cross(back, right), back
    view[:3, 3] = -view[:3, :3] @ eye
    scale = 1 / np.tan(np.radians(fov) / 2)
    clip = np.diag([scale / aspect, scale, (far + near) / (near - far), 0.0])
    clip[2, 3], clip[3, 2] = 2 * far * near / (near - far), -1.0
    return clip @ view


def _fragment(scene: scenes.Scene, source: str, call: str, result: str, parameters: dict) -> str:
    constants = "".join(f"    {_TYPES[len(v)]} {name} = {_literal(v)};\n" for name, v in parameters.items())
    lights = "".join(_light(light, gl.widened(call, result)) for light in scene.lights)
    return f"""#version 330
uniform vec3 lobe_eye;
in vec3 lobe_P;
in vec3 lobe_N;
in vec3 lobe_T;
layout(location = 0) out vec4 lobe_out;
layout(location = 1) out int lobe_triangle;
{source}
#line 1
void main() {{
    vec3 N = normalize(lobe_N);
    vec3 T = normalize(lobe_T - N * dot(N, lobe_T));
    vec3 V = normalize(lobe_eye - lobe_P);
    vec3 L;
{constants}    vec3 lobe_sum = vec3(0.0);
{lights}    lobe_out = vec4(lobe_sum, 1.0);
    lobe_triangle = gl_PrimitiveID + 1;
}}
"""


_TYPES = {1: "float", 2: "vec2", 3: "vec3"}


def _literal(values: tuple[float, ...]) -> str:
    numbers = ", ".join(f"{x:.9e}" for x in values)
    return numbers if len(values) == 1 else f"{_TYPES[len(values)]}({numbers})"


def _light(light: scenes.Light, value: str) -> str:
    vector, color = _literal(light.vector), _literal(light.color)
    if light.kind == "directional":
        towards, irradiance = f"    L = normalize({vector});\n", color
    else:
        towards = f"    L = {vector} - lobe_P;\n    float lobe_r2 = dot(L, L);\n    L /= sqrt(lobe_r2);\n"
        irradiance = f"{color} / lobe_r2"
    return f"    {{\n{towards}    lobe_sum += {value} * ({irradiance}) * max(dot(N, L), 0.0);\n    }}\n"
