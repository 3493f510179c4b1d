// In front goes the #version alone: 330 core, or 300 es and `precision highp float;`.
// Deferred shading, first pass: what the surface is. After mesh.vert, with a depth texture.
// RGBA16F for the normal and SRGB8_ALPHA8 for the colour do for most pictures.
uniform vec3 baseColor;
uniform float metallic;
uniform float roughness;
in vec3 interpolatedN;
layout(location = 0) out vec4 normalRoughness;
layout(location = 1) out vec4 baseMetallic;

void main() {
    normalRoughness = vec4(normalize(interpolatedN), roughness);
    baseMetallic = vec4(baseColor, metallic);
}
