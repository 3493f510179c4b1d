// WRONG ON PURPOSE. Forms of known formulas as textbooks print them and as engines use them, which lose their digits or
// divide by 0; the stability chart draws them beside the library's. Not part of the library: never paste from here.
// Each is written from the formula's description. float32 decides the rest.

const float PI = 3.14159265;

float half_cosine(vec3 N, vec3 V, vec3 L) { return dot(N, normalize(V + L)); }

// GGX

float ggx_lecture(vec3 N, vec3 V, vec3 L, float a) {  // also in WebGL engines today
    float c = half_cosine(N, V, L), d = c * c * (a * a - 1.0) + 1.0;
    return a * a / (PI * d * d);
}

float ggx_nested(vec3 N, vec3 V, vec3 L, float a) {  // (c a^2 - c) c + 1, one multiplication less
    float c = half_cosine(N, V, L), d = (c * a * a - c) * c + 1.0;
    return a * a / (PI * d * d);
}

float ggx_sine_first(vec3 N, vec3 V, vec3 L, float a) {  // (1 - c^2) + a^2 c^2: never 0, but the sine has no digits
    float c = half_cosine(N, V, L), d = (1.0 - c * c) + a * a * c * c;
    return a * a / (PI * d * d);
}

float ggx_tangent(vec3 N, vec3 V, vec3 L, float a) {  // by slopes, tan^2 from 1 - c^2
    float c2 = half_cosine(N, V, L);
    c2 *= c2;
    float e = 1.0 + (1.0 - c2) / (c2 * a * a);
    return 1.0 / (PI * a * a * c2 * c2 * e * e);
}

float ggx_cross_capped(vec3 N, vec3 V, vec3 L, float a) {  // |n x h|^2, capped to fit half precision
    vec3 h = normalize(V + L), x = cross(N, h);
    float c = dot(N, h), k = min(a / (dot(x, x) + a * c * a * c), 453.5);
    return k * k / PI;
}

// Beckmann, Blinn-Phong

float beckmann_tangent(vec3 N, vec3 V, vec3 L, float a) {
    float c2 = half_cosine(N, V, L);
    c2 *= c2;
    return exp((c2 - 1.0) / (a * a * c2)) / (PI * a * a * c2 * c2);
}

float beckmann_angle(vec3 N, vec3 V, vec3 L, float a) {
    float c = half_cosine(N, V, L), t = tan(acos(c)) / a;
    return exp(-t * t) / (PI * a * a * c * c * c * c);
}

float blinn_phong_pow(vec3 N, vec3 V, vec3 L, float e) {
    return (e + 2.0) / (2.0 * PI) * pow(half_cosine(N, V, L), e);
}

// Fresnel

float fresnel_cook_torrance(float c, float n) {
    float g = sqrt(n * n - 1.0 + c * c), a = (g - c) / (g + c), b = (c * (g + c) - 1.0) / (c * (g - c) + 1.0);
    return 0.5 * a * a * (1.0 + b * b);
}

float fresnel_amplitudes(float c, float n) {
    float t = sqrt(1.0 - (1.0 - c * c) / (n * n)), s = (c - n * t) / (c + n * t), p = (n * c - t) / (n * c + t);
    return 0.5 * (s * s + p * p);
}

float fresnel_sines(float c, float n) {
    float i = acos(c), t = asin(sin(i) / n);
    float s = sin(i - t) / sin(i + t), p = tan(i - t) / tan(i + t);
    return 0.5 * (s * s + p * p);
}

float conductor_squares(float c, float n, float k) {  // the form of most renderers
    float c2 = c * c, s2 = 1.0 - c2, t0 = n * n - k * k - s2;
    float ab = sqrt(t0 * t0 + 4.0 * n * n * k * k), t1 = ab + c2, a = sqrt(0.5 * (ab + t0)), t2 = 2.0 * a * c;
    float s = (t1 - t2) / (t1 + t2), t3 = c2 * ab + s2 * s2, t4 = t2 * s2;
    return 0.5 * s * (1.0 + (t3 - t4) / (t3 + t4));
}

float refracted_root(float c, float n) { return sqrt(1.0 - (1.0 - c * c) / (n * n)); }
float refracted_angle(float c, float n) { return cos(asin(sin(acos(c)) / n)); }

// Half vector

float half_dot(vec3 V, vec3 L) { return dot(L, normalize(V + L)); }
float half_root(vec3 V, vec3 L) { return sqrt(0.5 + 0.5 * dot(L, V)); }
float kelemen_dot(vec3 V, vec3 L) { float c = half_dot(V, L); return 1.0 / (4.0 * c * c); }
float kelemen_sum(vec3 V, vec3 L) { return 0.5 / (1.0 + dot(L, V)); }

// Masking

float g1_tangent(float c, float a) { return 2.0 / (1.0 + sqrt(1.0 + a * a * (1.0 - c * c) / (c * c))); }
float g1_angle(float c, float a) { float t = a * tan(acos(c)); return 2.0 / (1.0 + sqrt(1.0 + t * t)); }

// Diffuse

float oren_nayar_angles(vec3 N, vec3 V, vec3 L, float sigma) {
    float s2 = sigma * sigma, A = 1.0 - 0.5 * s2 / (s2 + 0.33), B = 0.45 * s2 / (s2 + 0.09);
    float i = acos(dot(N, L)), r = acos(dot(N, V));
    float azimuth = dot(normalize(V - N * dot(N, V)), normalize(L - N * dot(N, L)));
    return (A + B * max(azimuth, 0.0) * sin(max(i, r)) * tan(min(i, r))) / PI;
}

float eon_loss_listing(float c) {
    float s = sqrt(1.0 - c * c);
    return (0.5 - 2.0 / (3.0 * PI)) - (s * (acos(c) - s * c) + 2.0 / 3.0 * ((s / c) * (1.0 - s * s * s) - s)) / PI;
}

// A whole lobe from such parts: F D G / (4 NdotV NdotL)

float ggx_textbook(vec3 N, vec3 V, vec3 L, float f0, float a) {
    vec3 h = normalize(V + L);
    float nv = dot(N, V), nl = dot(N, L), F = f0 + (1.0 - f0) * pow(1.0 - dot(V, h), 5.0);
    float lv = (sqrt(1.0 + a * a * (1.0 - nv * nv) / (nv * nv)) - 1.0) / 2.0;
    float ll = (sqrt(1.0 + a * a * (1.0 - nl * nl) / (nl * nl)) - 1.0) / 2.0;
    return F * ggx_lecture(N, V, L, a) / ((1.0 + lv + ll) * 4.0 * nv * nl);
}

float cook_torrance_textbook(vec3 N, vec3 V, vec3 L, float f0, float a) {
    vec3 h = normalize(V + L);
    float nv = dot(N, V), nl = dot(N, L), nh = dot(N, h), vh = dot(V, h);
    float F = f0 + (1.0 - f0) * pow(1.0 - vh, 5.0), G = min(1.0, 2.0 * nh * min(nv, nl) / vh);
    return F * beckmann_tangent(N, V, L, a) * G / (4.0 * nv * nl);
}

// Ashikhmin-Shirley

float ashikhmin_shirley_listing(float c, float t, float b, float nu, float nv) {
    float e = (nu * t * t + nv * b * b) / (1.0 - c * c);
    return sqrt((nu + 2.0) * (nv + 2.0)) / (2.0 * PI) * pow(c, e);
}
