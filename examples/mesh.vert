// A mesh in world space, for every pass that draws one. In front goes the #version alone: 330 core or 300 es.
uniform mat4 viewProjection;
in vec3 position;
in vec3 normal;
in vec3 tangent;
out vec3 P;
out vec3 interpolatedN;
out vec3 interpolatedT;

void main() {
    P = position;
    interpolatedN = normal;
    interpolatedT = tangent;
    gl_Position = viewProjection * vec4(position, 1.0);
}
