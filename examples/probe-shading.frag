// ./lobe bundle lobe_alpha lobe_reflect lobe_DFG_GGX --target 330 | cat - examples/probe-shading.frag
// Image-based light: a surface under a probe that probe-prefilter.frag has prepared. After mesh.vert.
uniform highp sampler2D probe;       // mip level i holds roughness i / lastLevel
uniform float lastLevel;
uniform highp sampler2D irradiance;  // the probe convolved with the cosine, over pi
uniform vec3 eye;
uniform vec3 baseColor;
uniform float metallic;
uniform float roughness;
in vec3 P;
in vec3 interpolatedN;
layout(location = 0) out vec4 color;

vec2 latLong(vec3 d) {
    return vec2(0.5 + atan(d.x, -d.z) * 0.159154943, acos(clamp(d.y, -1.0, 1.0)) * 0.318309886);
}

void main() {
    vec3 N = normalize(interpolatedN), V = normalize(eye - P);
    vec3 f0 = mix(vec3(0.04), baseColor, metallic), albedo = baseColor * (1.0 - metallic);
    vec2 dfg = lobe_DFG_GGX(dot(N, V), lobe_alpha(roughness));
    vec3 reflected = f0 * dfg.x + dfg.y;
    color.rgb = reflected * textureLod(probe, latLong(lobe_reflect(N, V)), roughness * lastLevel).rgb
              + (1.0 - reflected) * albedo * textureLod(irradiance, latLong(N), 0.0).rgb;
    color.a = 1.0;
}
