// ./lobe bundle lobe_alpha lobe_Lambert lobe_GGX --target 330 | cat - examples/deferred-lighting.frag
// Deferred shading, second pass: the light of a sun and a lamp on what the first pass has left. After screen.vert.
uniform highp sampler2D normalRoughness;
uniform highp sampler2D baseMetallic;
uniform highp sampler2D depth;
uniform mat4 inverseViewProjection;
uniform vec3 eye;
uniform vec3 sunDirection;  // towards the sun, unit
uniform vec3 sunColor;      // its irradiance on a surface that faces it
uniform vec3 lampPosition;
uniform vec3 lampColor;     // its intensity: irradiance at distance 1
in vec2 uv;
layout(location = 0) out vec4 color;

vec3 shade(vec3 N, vec3 V, vec3 L, vec3 light, vec4 base, float alpha) {
    vec3 f0 = mix(vec3(0.04), base.rgb, base.a);
    vec3 f = lobe_Lambert(N, V, L, base.rgb * (1.0 - base.a)) + lobe_GGX(N, V, L, f0, alpha);
    return f * light * max(dot(N, L), 0.0);
}

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    float z = texelFetch(depth, pixel, 0).r;
    if (z == 1.0) discard;  // nothing was drawn here
    vec4 world = inverseViewProjection * vec4(vec3(uv, z) * 2.0 - 1.0, 1.0);
    vec3 P = world.xyz / world.w, V = normalize(eye - P);
    vec4 surface = texelFetch(normalRoughness, pixel, 0), base = texelFetch(baseMetallic, pixel, 0);
    vec3 N = normalize(surface.xyz);
    float alpha = lobe_alpha(surface.w);
    vec3 toLamp = lampPosition - P;
    color.rgb = shade(N, V, sunDirection, sunColor, base, alpha)
              + shade(N, V, normalize(toLamp), lampColor / dot(toLamp, toLamp), base, alpha);
    color.a = 1.0;
}
