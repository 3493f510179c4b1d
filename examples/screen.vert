// One triangle that covers the target, without any buffer. In front goes the #version alone: 330 core or 300 es.
out vec2 uv;

void main() {
    uv = vec2(float(gl_VertexID & 1), float(gl_VertexID >> 1)) * 2.0;
    gl_Position = vec4(uv * 2.0 - 1.0, 0.0, 1.0);
}
