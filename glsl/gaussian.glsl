// The Gaussian of the facets' tilt angle: Torrance and Sparrow's distribution, and Blinn's.
// needs  core, fresnel, masking
#ifndef LOBE_CORE_GLSL
#error "gaussian.glsl needs core.glsl: put core.glsl before it"
#endif
#ifndef LOBE_FRESNEL_GLSL
#error "gaussian.glsl needs fresnel.glsl: put fresnel.glsl before it"
#endif
#ifndef LOBE_MASKING_GLSL
#error "gaussian.glsl needs masking.glsl: put masking.glsl before it"
#endif
#ifndef LOBE_GAUSSIAN_GLSL
#define LOBE_GAUSSIAN_GLSL

// Gaussian distribution of the facets' tilt from a cosine, with the cosine but without a factor: 1 at its peak.
//   D = cos(d) exp(-(d / alpha)^2),   d the angle between the normal and the half vector [rad]
// param  alpha  float  1e-4..4  0.25  angle at which exp has fallen to 1/e [rad]
// normalised  no, its integral is 0.0311 at alpha = 0.1, 1.33 at alpha = 1: about pi alpha^2 where narrow
// units       16, exp, and a fit stands for atan
// source      Torrance, Sparrow 1967; Blinn 1977
// Take the vector form where alpha is small, as in lobe_D_GGX.
float lobe_D_Gaussian(float NdotH, float alpha) {
    float c = clamp(NdotH, 0.0, 1.0);
    float d = lobe_angle_of_half(sqrt((1.0 - c) / (1.0 + c)));
    float x = d / clamp(alpha, LOBE_ALPHA_MIN, LOBE_ALPHA_MAX);
    return c * exp(-x * x);
}

// Gaussian distribution of the facets' tilt, with the cosine but without a factor: 1 at its peak; H may have any length.
//   D = cos(d) exp(-(d / alpha)^2),   d the angle between the normal and the half vector [rad]
// param  alpha  float  1e-4..4  0.25  angle at which exp has fallen to 1/e [rad]
// normalised  no, its integral is 0.0311 at alpha = 0.1, 1.33 at alpha = 1: about pi alpha^2 where narrow
// units       16, exp, and a fit stands for atan
// source      Torrance, Sparrow 1967; Blinn 1977
// Why this form: tan(d / 2) = |N x H| / (|H| + N.H) keeps its digits at the peak.
float lobe_D_Gaussian(vec3 N, vec3 H, float alpha) {
    vec3 X = cross(N, H);
    float NH = max(dot(N, H), 0.0), sine = length(X);
    float hypotenuse = max(length(vec2(sine, NH)), LOBE_SMALLEST_DIVISOR);
    float d = lobe_angle_of_half(sine / (hypotenuse + NH));
    float x = d / clamp(alpha, LOBE_ALPHA_MIN, LOBE_ALPHA_MAX);
    return NH / hypotenuse * exp(-x * x);
}

// Peak of the normalised Gaussian of the facets' tilt: lobe_D_Gaussian_normalized at H = N, the inverse of its integral.
//   1 / n,   n = pi times the integral of exp(-(d / alpha)^2) sin(2 d) over d in 0..pi/2     [1/sr]
// param  alpha  float  1e-4..4  0.25  angle at which the Gaussian has fallen to 1/e [rad]
// units   16, a fit
// source  Torrance, Sparrow 1967; Blinn 1977
// Why this form: n / (pi alpha^2) is smooth, and 7e-8 off at most, up to alpha = 4, in a rational fit of alpha^2
// (lab/fits.py). The closed form in Dawson's function, pi alpha Dawson(alpha), counts angles past the horizon: 1.8 % off at
// alpha = 1.
float lobe_peak_Gaussian(float alpha) {
    float a = clamp(alpha, LOBE_ALPHA_MIN, LOBE_ALPHA_MAX), x = a * a;
    float p = 0.999999934 + x * (4.199668102 + x * (16.132323145 + x * (41.886900686 + x * (72.397065024
              + x * 75.669204962))));
    float q = 1.0 + x * (4.866305777 + x * (19.111869592 + x * (53.355054272 + x * (103.860143799 + x * (127.913945995
              + x * 75.669272234)))));
    return LOBE_INV_PI * q / (x * p);
}

// Gaussian distribution of the facets' tilt from a cosine, normalised over the hemisphere.
//   D = exp(-(d / alpha)^2) / n,   d the angle between the normal and the half vector [rad]
//   n = pi times the integral of exp(-(d / alpha)^2) sin(2 d) over d in 0..pi/2              [1/sr]
// param  alpha  float  1e-4..4  0.25  angle at which D has fallen to 1/e [rad]
// normalised  yes
// family      gaussian
// units       16, exp, and fits stand for atan and n
// source      Torrance, Sparrow 1967; Blinn 1977
// Take the vector form where alpha is small, as in lobe_D_GGX.
float lobe_D_Gaussian_normalized(float NdotH, float alpha) {
    float c = clamp(NdotH, 0.0, 1.0);
    float d = lobe_angle_of_half(sqrt((1.0 - c) / (1.0 + c)));
    float x = d / clamp(alpha, LOBE_ALPHA_MIN, LOBE_ALPHA_MAX), k = exp(-0.5 * x * x);
    return k * (k * lobe_peak_Gaussian(alpha));
}

// Gaussian distribution of the facets' tilt, normalised over the hemisphere; H may have any length.
//   D = exp(-(d / alpha)^2) / n,   d the angle between the normal and the half vector [rad]
//   n = pi times the integral of exp(-(d / alpha)^2) sin(2 d) over d in 0..pi/2              [1/sr]
// param  alpha  float  1e-4..4  0.25  angle at which D has fallen to 1/e [rad]
// normalised  yes
// family      gaussian
// units       16, exp, and fits stand for atan and n
// source      Torrance, Sparrow 1967; Blinn 1977
// Why this form: half the exponent twice, since exp ends at -87 and V can be large where D is small.
float lobe_D_Gaussian_normalized(vec3 N, vec3 H, float alpha) {
    if (dot(H, H) == 0.0) return 0.0;
    vec3 X = cross(N, H);
    float NH = max(dot(N, H), 0.0), sine = length(X);
    float d = lobe_angle_of_half(sine / max(length(vec2(sine, NH)) + NH, LOBE_SMALLEST_DIVISOR));
    float x = d / clamp(alpha, LOBE_ALPHA_MIN, LOBE_ALPHA_MAX), k = exp(-0.5 * x * x);
    return k * (k * lobe_peak_Gaussian(alpha));
}

// Torrance and Sparrow's reflection: facets of Gaussian tilt, masked by V-grooves, with Schlick's Fresnel term.
//   f = D G F / (4 NdotV NdotL)                                                    [1/sr]
// param  f0     color  0.01..1  0.04  reflectance at normal incidence, linear RGB
// param  alpha  float  1e-4..4  0.25  angle at which D has fallen to 1/e [rad]
// reciprocal  yes
// energy      <= 1
// family      specular
// units       16, exp, and the lengths of N, V and L as in lobe_GGX
// source      Torrance, Sparrow 1967, with 1/4 in the place of their constant; Schlick 1994, eq. 15
// Draw from lobe_sample_GGX of the same alpha: its tail is the longer one, so that weights stay bounded. Beckmann's is not.
vec3 lobe_TorranceSparrow(vec3 N, vec3 V, vec3 L, vec3 f0, float alpha) {
    vec3 H = lobe_H(V, L);
    vec2 c = lobe_cosines(N, V, L, H);
    if (min(c.x, c.y) <= 0.0) return vec3(0.0);
    float LdotH = 0.5 * length(H);
    float NdotH = 0.5 * (c.x + c.y) / max(LdotH, LOBE_SMALLEST_DIVISOR);
    float DV = lobe_D_Gaussian_normalized(N, H, alpha) * lobe_V_Vgroove(c.x, c.y, NdotH, LdotH);
    return DV * lobe_F_Schlick(LdotH, clamp(f0, 0.0, 1.0));
}

#endif
