// ./lobe bundle lobe_alpha lobe_GGX_aniso LOBE_F0_ALUMINIUM --target 330 | cat - examples/brushed.frag
// Brushed aluminium under a sun and a lamp: smooth along the strokes T, rough across. After mesh.vert.
uniform vec3 eye;
uniform vec3 sunDirection;  // towards the sun, unit
uniform vec3 sunColor;      // its irradiance on a surface that faces it
uniform vec3 lampPosition;
uniform vec3 lampColor;     // its intensity: irradiance at distance 1
uniform float roughnessAlong;
uniform float roughnessAcross;
in vec3 P;
in vec3 interpolatedN;
in vec3 interpolatedT;
layout(location = 0) out vec4 color;

vec3 shade(vec3 N, vec3 T, vec3 V, vec3 L, vec3 light) {
    float alphaX = lobe_alpha(roughnessAlong), alphaY = lobe_alpha(roughnessAcross);
    return lobe_GGX_aniso(N, T, V, L, LOBE_F0_ALUMINIUM, alphaX, alphaY) * light * max(dot(N, L), 0.0);
}

void main() {
    vec3 N = normalize(interpolatedN), V = normalize(eye - P);
    vec3 T = normalize(interpolatedT - N * dot(N, interpolatedT));
    vec3 toLamp = lampPosition - P;
    color.rgb = shade(N, T, V, sunDirection, sunColor)
              + shade(N, T, V, normalize(toLamp), lampColor / dot(toLamp, toLamp));
    color.a = 1.0;
}
