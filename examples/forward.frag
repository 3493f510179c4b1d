// ./lobe bundle lobe_alpha lobe_Lambert lobe_GGX --target 330 | cat - examples/forward.frag
// Forward shading: a painted or metallic surface under a sun and a lamp. After mesh.vert. Writes linear RGB.
uniform vec3 eye;
uniform vec3 sunDirection;  // towards the sun, unit
uniform vec3 sunColor;      // its irradiance on a surface that faces it
uniform vec3 lampPosition;
uniform vec3 lampColor;     // its intensity: irradiance at distance 1
uniform vec3 baseColor;
uniform float metallic;
uniform float roughness;
in vec3 P;
in vec3 interpolatedN;
layout(location = 0) out vec4 color;

vec3 shade(vec3 N, vec3 V, vec3 L, vec3 light) {
    vec3 f0 = mix(vec3(0.04), baseColor, metallic);
    vec3 f = lobe_Lambert(N, V, L, baseColor * (1.0 - metallic)) + lobe_GGX(N, V, L, f0, lobe_alpha(roughness));
    return f * light * max(dot(N, L), 0.0);
}

void main() {
    vec3 N = normalize(interpolatedN), V = normalize(eye - P);
    vec3 toLamp = lampPosition - P;
    color.rgb = shade(N, V, sunDirection, sunColor)
              + shade(N, V, normalize(toLamp), lampColor / dot(toLamp, toLamp));
    color.a = 1.0;
}
