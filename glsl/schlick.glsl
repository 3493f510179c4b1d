// Schlick's rational functions.
// needs  core
#ifndef LOBE_CORE_GLSL
#error "schlick.glsl needs core.glsl: put core.glsl before it"
#endif
#ifndef LOBE_SCHLICK_GLSL
#define LOBE_SCHLICK_GLSL

// Power of a cosine, replaced by a quotient: s^h where s is near 1, far more than it in the tail.
//   s / (h - h s + s)
// param  s  float  0..1    0.9   cosine
// param  h  float  0..1e6  50.0  exponent of the cosine
// family  power
// units   8
// source  Schlick 1994, eq. 4
// Why this form: h (1 - s) is exact where s is near 1, h - h s is not.
float lobe_pow_Schlick(float s, float h) {
    float x = clamp(s, 0.0, 1.0);
    return x / max(clamp(h, 0.0, 1e9) * (1.0 - x) + x, LOBE_SMALLEST_DIVISOR);
}

#endif
