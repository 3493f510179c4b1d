// ./lobe bundle lobe_reflect lobe_sample_GGX lobe_pdf_GGX --target 330 | cat - examples/probe-prefilter.frag
// Image-based light, done once for each level: a latitude-longitude probe as surfaces of one width see it, each texel
// for N = V. After screen.vert. Both pictures have +y on top, in the first row, and -z in the middle.
uniform highp sampler2D radiance;  // linear RGB, RGBA16F, with mipmaps; repeats in u
uniform float alpha;
uniform bool diffuse;  // convolve with the cosine, for Lambert, in place of GGX
uniform int samples;
in vec2 uv;
layout(location = 0) out vec4 color;

const float PI = 3.14159265;

vec2 latLong(vec3 d) {
    return vec2(0.5 + atan(d.x, -d.z) / (2.0 * PI), acos(clamp(d.y, -1.0, 1.0)) / PI);
}

void main() {
    float phi = (uv.x - 0.5) * 2.0 * PI, theta = uv.y * PI;
    vec3 N = vec3(sin(theta) * sin(phi), cos(theta), -sin(theta) * cos(phi)), T = vec3(cos(phi), 0.0, sin(phi));
    vec2 size = vec2(textureSize(radiance, 0));
    vec4 sum = vec4(0.0);
    for (int i = 0; i < samples; ++i) {
        vec2 u = vec2(fract(float(i) * 0.618033989), (float(i) + 0.5) / float(samples));
        vec3 L;
        if (diffuse) {
            vec2 slope = sqrt(u.y) * vec2(cos(2.0 * PI * u.x), sin(2.0 * PI * u.x));
            L = slope.x * T + slope.y * cross(N, T) + sqrt(1.0 - u.y) * N;
        } else {
            L = lobe_reflect(lobe_sample_GGX(N, T, N, alpha, u), N);
        }
        float NdotL = dot(N, L);
        if (NdotL <= 0.0) continue;
        // Few samples do, since each reads the mip level whose texel is as large as its share of the sphere
        // (Krivanek and Colbert 2008).
        float pdf = diffuse ? NdotL / PI : lobe_pdf_GGX(N, N, L, alpha);
        float texel = 2.0 * PI * PI * sqrt(max(1.0 - L.y * L.y, 1e-4)) / (size.x * size.y);
        float level = max(0.5 * log2(1.0 / (float(samples) * pdf * texel)), 0.0);
        float weight = diffuse ? 1.0 : NdotL;
        sum += weight * vec4(textureLod(radiance, latLong(L), level).rgb, 1.0);
    }
    color = vec4(sum.rgb / sum.a, 1.0);
}
