// Diffuse reflection of rough surfaces: facets that are Lambertian themselves, after Oren and Nayar.
// needs  core
#ifndef LOBE_CORE_GLSL
#error "oren_nayar.glsl needs core.glsl: put core.glsl before it"
#endif
#ifndef LOBE_OREN_NAYAR_GLSL
#define LOBE_OREN_NAYAR_GLSL

// Oren-Nayar's qualitative model: brighter towards the light than Lambert, and flatter to the rim.
//   f = albedo / pi (A + B max(0, cos dphi) sin a tan b),   a = max(theta_V, theta_L), b = min(theta_V, theta_L)
//   A = 1 - 0.5 sigma^2 / (sigma^2 + 0.33),   B = 0.45 sigma^2 / (sigma^2 + 0.09)    [1/sr]
// param  albedo  color  0..1  0.5  reflected fraction of the light on one facet, linear RGB
// param  sigma  float  0..1.5  0.3  standard deviation of the facets' tilt angle [rad]
// reciprocal  yes
// energy      no, 1.0152 at sigma = 0.2, at grazing
// family      diffuse
// units       8
// source      Oren, Nayar 1994, eq. 30
// Why this form: cos dphi sin a tan b = (LdotV - NdotL NdotV) / max(NdotL, NdotV) needs no angles and no projected
// directions, which vanish at V = N.
vec3 lobe_OrenNayar_qualitative(vec3 N, vec3 V, vec3 L, vec3 albedo, float sigma) {
    float NdotV = dot(N, V), NdotL = dot(N, L);
    if (min(NdotV, NdotL) <= 0.0) return vec3(0.0);
    float angle = clamp(sigma, 0.0, 10.0);
    float sigma2 = angle * angle;
    float A = 1.0 - 0.5 * sigma2 / (sigma2 + 0.33);
    float B = 0.45 * sigma2 / (sigma2 + 0.09);
    float s = clamp(dot(L, V) - NdotL * NdotV, 0.0, 1.0);
    float t = s / max(max(NdotL, NdotV), LOBE_SMALLEST_DIVISOR);
    return clamp(albedo, 0.0, 1.0) * (LOBE_INV_PI * (A + B * t));
}

// Oren and Nayar's full model of 1994: Lambertian facets of Gaussian tilt, with one interreflection between them.
//   f = albedo / pi (C1 + cos dphi C2 tan b + (1 - |cos dphi|) C3 tan((a + b) / 2))
//     + 0.17 albedo^2 / pi sigma^2 / (sigma^2 + 0.13) (1 - cos dphi (2 b / pi)^2)             [1/sr]
//   a = max(theta_V, theta_L), b = min(theta_V, theta_L), q = sigma^2 / (sigma^2 + 0.09)
//   C1 = 1 - 0.5 sigma^2 / (sigma^2 + 0.33),   C3 = 0.125 q (4 a b / pi^2)^2
//   C2 = 0.45 q sin a where cos dphi >= 0, 0.45 q (sin a - (2 b / pi)^3) elsewhere
// param  albedo  color  0..1  0.5  reflected fraction of the light on one facet, linear RGB
// param  sigma   float  0..0.6  0.3  standard deviation of the facets' tilt angle [rad]
// reciprocal  yes
// energy      no, 1.050 at sigma = 0.3, at 89.9 degrees
// family      diffuse
// units       32, the fitted angles are seven roundings off and enter C2 to the third power, C3 to the second each
// source      Oren, Nayar 1994, eq. 27 to 30
// Above sigma = 0.65 the published formula turns negative where both directions graze from opposite sides: 0 here.
// Why this form: it needs the angles themselves: w = asin(c) / (c pi/2) is a fit within 4e-7 (lab/fits.py), and 1 - c w
// is theta / (pi/2). What sin a - (2 b / pi)^3 and 1 - |cos dphi| have left at grazing is divided by cosines there, so
// that neither may be a difference of rounded numbers: 1 - sin a = cos^2 a / (1 + sin a), and
// sin a sin b (1 - cos dphi) = |V - L|^2 / 2 - (1 - cos(a - b)), or with V + L, a + b for a negative cosine.
vec3 lobe_OrenNayar(vec3 N, vec3 V, vec3 L, vec3 albedo, float sigma) {
    vec2 c = min(vec2(dot(N, V), dot(N, L)), 1.0);
    if (min(c.x, c.y) <= 0.0) return vec3(0.0);
    c = vec2(min(c.x, c.y), max(max(c.x, c.y), LOBE_SMALLEST_DIVISOR));  // of a and b
    vec2 s = sqrt((1.0 - c) * (1.0 + c));
    float cc = c.x * c.y, ss = max(s.x * s.y, LOBE_SMALLEST_DIVISOR);
    vec2 w = 3.80449445 + c * (-5.49958143 + c * (3.67576926 + c * (-1.07001387 + c * 0.089332013)))
             + sqrt(1.0 - c) * (-3.16787493 + c * (3.91566987 + c * (-2.00824865 + c * 0.360093496)));
    vec2 t = 1.0 - c * w;  // angles over pi / 2
    float b = t.y, ab = t.x * t.y;
    float side = dot(L, V) - cc;  // sin a sin b cos dphi
    float turn = side < 0.0 ? -1.0 : 1.0;
    vec3 D = side < 0.0 ? lobe_H(V, L) : V - L;
    float d = c.y - turn * c.x;
    float off = 0.5 * dot(D, D) - d * d / max(1.0 - turn * cc + ss, LOBE_SMALLEST_DIVISOR);  // ss (1 - |cos dphi|)

    float angle = clamp(sigma, 0.0, 10.0), sigma2 = angle * angle;
    float q = sigma2 / (sigma2 + 0.09);
    float lift = side < 0.0 ? (w.y * (1.0 + b + b * b) - c.x * c.x / ((1.0 + s.x) * c.y)) / max(s.x, 1e-4) : 1.0 / c.y;
    float f1 = 1.0 - 0.5 * sigma2 / (sigma2 + 0.33) + 0.45 * q * clamp(side, -1.0, 1.0) * lift
               + 0.125 * q * ab * ab * clamp(off / ss, 0.0, 1.0) * (s.x + s.y) / (c.x + c.y);
    float f2 = 0.17 * sigma2 / (sigma2 + 0.13) * (1.0 - clamp(side / ss, -1.0, 1.0) * b * b);
    vec3 rho = clamp(albedo, 0.0, 1.0);
    return rho * (LOBE_INV_PI * max(f1 + rho * f2, 0.0));
}

// What single scattering lacks in energy-preserving Oren-Nayar (EON), as a function of the cosine alone.
//   1 - E = A roughness loss,   A = 1 / (1 + c1 roughness), c1 = 1/2 - 2 / (3 pi)
//   loss = c1 - G / pi,   G = s (theta - s c) + 2/3 (s (1 - s^3) / c - s),   c = NdotX = cos(theta), s = sin(theta)
// units   16, a fit stands for acos
// source  Portsmouth, Kutz, Hill 2025
// Why this form: loss / c = P(c) + s Q(c) has no acos and no 0 / 0; the polynomials are within 2.7e-7 (lab/fits.py).
float lobe_loss_EON(float NdotX) {
    float c = clamp(NdotX, 0.0, 1.0);
    float s = sqrt(1.0 - c * c);
    float p = 0.84775654 + c * (-0.63601406 + c * (-0.32554566 + c * (0.6070407 + c * -0.20544403)));
    float q = -0.52944657 + c * (0.77989917 + c * (-0.12459672 + c * (-0.183374 + c * 0.05751494)));
    return c * (p + s * q);
}

// What single scattering lacks in energy-preserving Oren-Nayar (EON), by a shorter fit.
//   loss = c (p0 + p1 c + p2 c^2 + p3 c^3),   c = NdotX
// approximates  exact  max error 3.3e-4 absolute  everywhere
// units   8
// source  lab/fits.py; the exact function is Portsmouth, Kutz, Hill 2025
float lobe_loss_EON_fast(float NdotX) {
    float c = clamp(NdotX, 0.0, 1.0);
    return c * (0.32633489 + c * (0.08384723 + c * (-0.05240173 + c * -0.06966051)));
}

// Energy-preserving Oren-Nayar (EON): a white surface reflects all light, at any roughness.
//   f = albedo A / pi (1 + roughness s / t) + M / pi (1 - E(NdotV)) (1 - E(NdotL)) / (1 - Em)  [1/sr]
//   s = LdotV - NdotL NdotV, t = max(NdotL, NdotV) where s > 0, else 1;   E as in lobe_loss_EON
//   A = 1 / (1 + c1 roughness), Em = A (1 + c2 roughness), M = albedo^2 Em / (1 - albedo (1 - Em))
//   c1 = 1/2 - 2 / (3 pi), c2 = 2/3 - 28 / (15 pi)
// param  albedo     color  0..1  0.5  reflected fraction of the light on one facet, linear RGB
// param  roughness  float  0..1  0.5  EON's own: neither sigma nor alpha, and lobe_alpha has no business with it
// reciprocal  yes
// energy      <= 1
// family      diffuse
// units       16, the fit in lobe_loss_EON
// source      Portsmouth, Kutz, Hill 2025
// Why this form: 1 + s = |V + L|^2 / 2 - NdotL NdotV keeps its digits where V and L are opposite and all is dark, s
// itself where they are at right angles, both grazing. With 1 - E = A roughness loss the last quotient has no 0 / 0 at
// roughness = 0.
vec3 lobe_OrenNayar_EON(vec3 N, vec3 V, vec3 L, vec3 albedo, float roughness) {
    float NdotV = dot(N, V), NdotL = dot(N, L);
    if (min(NdotV, NdotL) <= 0.0) return vec3(0.0);
    float r = clamp(roughness, 0.0, 1.0);
    vec3 rho = clamp(albedo, 0.0, 1.0), H = lobe_H(V, L);
    float A = 1.0 / (1.0 + 0.287793409 * r);
    float s = min(dot(L, V) - NdotL * NdotV, 1.0), t = max(max(NdotL, NdotV), LOBE_SMALLEST_DIVISOR);
    float s1 = clamp(0.5 * dot(H, H) - NdotL * NdotV, 0.0, 1.0);  // 1 + s
    float single = A * (s > 0.0 ? 1.0 + r * s / t : 1.0 - r + r * s1);
    float lost = A * r * 4.64457037 * lobe_loss_EON(NdotV) * lobe_loss_EON(NdotL);  // 1 / (c1 - c2)
    float Em = A * (1.0 + 0.0724882111 * r);
    return rho * (LOBE_INV_PI * (single + rho * Em / (1.0 - rho * (1.0 - Em)) * lost));
}

// Directional albedo of energy-preserving Oren-Nayar (EON).
//   albedo E + M (1 - E),   E(NdotV) as in lobe_loss_EON, M as in lobe_OrenNayar_EON
// param  albedo     color  0..1  0.5  reflected fraction of the light on one facet, linear RGB
// param  roughness  float  0..1  0.5  EON's own: neither sigma nor alpha, and lobe_alpha has no business with it
// family  albedo
// units   16, the fit in lobe_loss_EON
// source  Portsmouth, Kutz, Hill 2025
vec3 lobe_albedo_EON(float NdotV, vec3 albedo, float roughness) {
    float r = clamp(roughness, 0.0, 1.0);
    vec3 rho = clamp(albedo, 0.0, 1.0);
    float A = 1.0 / (1.0 + 0.287793409 * r);
    float lost = A * r * lobe_loss_EON(NdotV);
    float Em = A * (1.0 + 0.0724882111 * r);
    return rho * (1.0 - lost + rho * Em / (1.0 - rho * (1.0 - Em)) * lost);
}

// Energy-preserving Oren-Nayar (EON) with the shorter fit of its albedo.
//   f = albedo A / pi (1 + roughness s / t) + M / pi (1 - E(NdotV)) (1 - E(NdotL)) / (1 - Em)  [1/sr]
//   s = LdotV - NdotL NdotV, t = max(NdotL, NdotV) where s > 0, else 1;   E as in lobe_loss_EON
//   A = 1 / (1 + c1 roughness), Em = A (1 + c2 roughness), M = albedo^2 Em / (1 - albedo (1 - Em))
//   c1 = 1/2 - 2 / (3 pi), c2 = 2/3 - 28 / (15 pi)
// param  albedo     color  0..1  0.5  reflected fraction of the light on one facet, linear RGB
// param  roughness  float  0..1  0.5  EON's own: neither sigma nor alpha, and lobe_alpha has no business with it
// approximates  exact  max error 2.2e-4 absolute  everywhere
// reciprocal  yes
// energy      <= 1.0005
// family      diffuse
// units       8
// source      Portsmouth, Kutz, Hill 2025
// Why this form: 1 + s = |V + L|^2 / 2 - NdotL NdotV keeps its digits where V and L are opposite and all is dark, s
// itself where they are at right angles, both grazing. With 1 - E = A roughness loss the last quotient has no 0 / 0 at
// roughness = 0.
vec3 lobe_OrenNayar_EON_fast(vec3 N, vec3 V, vec3 L, vec3 albedo, float roughness) {
    float NdotV = dot(N, V), NdotL = dot(N, L);
    if (min(NdotV, NdotL) <= 0.0) return vec3(0.0);
    float r = clamp(roughness, 0.0, 1.0);
    vec3 rho = clamp(albedo, 0.0, 1.0), H = lobe_H(V, L);
    float A = 1.0 / (1.0 + 0.287793409 * r);
    float s = min(dot(L, V) - NdotL * NdotV, 1.0), t = max(max(NdotL, NdotV), LOBE_SMALLEST_DIVISOR);
    float s1 = clamp(0.5 * dot(H, H) - NdotL * NdotV, 0.0, 1.0);  // 1 + s
    float single = A * (s > 0.0 ? 1.0 + r * s / t : 1.0 - r + r * s1);
    float lost = A * r * 4.64457037 * lobe_loss_EON_fast(NdotV) * lobe_loss_EON_fast(NdotL);  // 1 / (c1 - c2)
    float Em = A * (1.0 + 0.0724882111 * r);
    return rho * (LOBE_INV_PI * (single + rho * Em / (1.0 - rho * (1.0 - Em)) * lost));
}

// Directional albedo of energy-preserving Oren-Nayar (EON), with the shorter fit of its albedo.
//   albedo E + M (1 - E),   E(NdotV) as in lobe_loss_EON, M as in lobe_OrenNayar_EON
// param  albedo     color  0..1  0.5  reflected fraction of the light on one facet, linear RGB
// param  roughness  float  0..1  0.5  EON's own: neither sigma nor alpha, and lobe_alpha has no business with it
// approximates  exact  max error 1e-4 absolute  everywhere
// family  albedo
// units   8
// source  Portsmouth, Kutz, Hill 2025
vec3 lobe_albedo_EON_fast(float NdotV, vec3 albedo, float roughness) {
    float r = clamp(roughness, 0.0, 1.0);
    vec3 rho = clamp(albedo, 0.0, 1.0);
    float A = 1.0 / (1.0 + 0.287793409 * r);
    float lost = A * r * lobe_loss_EON_fast(NdotV);
    float Em = A * (1.0 + 0.0724882111 * r);
    return rho * (1.0 - lost + rho * Em / (1.0 - rho * (1.0 - Em)) * lost);
}

// Light direction of energy-preserving Oren-Nayar (EON) at random: a unit L, by a clipped linearly transformed cosine.
//   u.x < P: uniform on the hemisphere; else L = normalize(M w), w from the cosine lobe's part that M keeps above the horizon
//   M = (a 0 b; 0 c 0; d 0 1), P, a, b, c, d fits of NdotV and roughness, x towards V along the surface
// param  roughness  float  0..1  0.5  EON's own, as in lobe_OrenNayar_EON
// param  u          vec2   0..0.9999999  0.5  uniform random numbers: u.x for the part and the radius, u.y for the azimuth
// units   16, pow
// source  Portsmouth, Kutz, Hill 2025, listings 2, 3
// Why this form: near mu = NdotV = 1 the fits P, b and d are differences of what nearly cancels, and are written in w = 1 - mu.
// pow(0, 0.1) is not 0 on all drivers.
vec3 lobe_sample_EON(vec3 N, vec3 T, vec3 V, float roughness, vec2 u) {
    vec3 X = cross(N, V);
    float mu = clamp(dot(N, V), 0.0, 1.0), w = min(dot(X, X) / (1.0 + mu), 1.0), r = clamp(roughness, 0.0, 1.0);
    float a = 1.0 + r * (0.303392 + (-0.518982 + 0.111709 * mu) * mu + (-0.276266 + 0.335918 * mu) * r);
    float b = r * (-0.00548 + 0.00071 * r + (-1.15859 + 0.150105 * r) * w) / (mu * mu * mu - 1.43545);
    float c = 1.0 + r * (0.20013 + (-0.506373 + 0.261777 * mu) * mu);
    float d = r * (6e-6 - (0.065466 + 0.475392 * w) * w) / (0.0017372 + (2.0725628 - w) * w);
    float s = 0.5 + 0.5 / sqrt(1.0 + d * d);
    float uniformly = (r > 0.0 ? pow(r, 0.1) : 0.0) * (0.038278 + w * (0.168058 + w * (-0.334233 + 0.290822 * w)));
    X = cross(X, N);
    float size = length(X);
    X = size > 0.0 ? X / size : T;
    vec3 Y = cross(N, X);
    vec2 x = clamp(u, 0.0, 1.0);
    vec2 turn = lobe_circle(x.y);
    if (x.x < uniformly) {
        float z = x.x / uniformly;
        turn *= sqrt((1.0 - z) * (1.0 + z));
        return turn.x * X + turn.y * Y + z * N;
    }
    turn *= sqrt(clamp((x.x - uniformly) / (1.0 - uniformly), 0.0, 1.0));
    float wx = -((1.0 - s) * sqrt(max(1.0 - turn.y * turn.y, 0.0)) + s * turn.x);
    float wz = sqrt(max(1.0 - wx * wx - turn.y * turn.y, 0.0));
    vec3 L = (a * wx + b * wz) * X + c * turn.y * Y + (d * wx + wz) * N;
    return L / max(length(L), LOBE_SMALLEST_DIVISOR);
}

// Density of lobe_sample_EON, over the solid angle of L.
//   pdf = P / (2 pi) + (1 - P) |M|^2 / |q|^4 max(q.z, 0) / (pi s),   q = adj(M) L, s = (1 + 1 / sqrt(1 + d^2)) / 2  [1/sr]
// param  roughness  float  0..1  0.5  EON's own, as in lobe_OrenNayar_EON
// units   16, pow
// source  Portsmouth, Kutz, Hill 2025, listings 2, 3
// Why this form: as in lobe_sample_EON.
// 0 where V or L is below the horizon.
float lobe_pdf_EON(vec3 N, vec3 T, vec3 V, vec3 L, float roughness) {
    if (min(dot(N, V), dot(N, L)) <= 0.0) return 0.0;
    vec3 X = cross(N, V);
    float mu = clamp(dot(N, V), 0.0, 1.0), w = min(dot(X, X) / (1.0 + mu), 1.0), r = clamp(roughness, 0.0, 1.0);
    float a = 1.0 + r * (0.303392 + (-0.518982 + 0.111709 * mu) * mu + (-0.276266 + 0.335918 * mu) * r);
    float b = r * (-0.00548 + 0.00071 * r + (-1.15859 + 0.150105 * r) * w) / (mu * mu * mu - 1.43545);
    float c = 1.0 + r * (0.20013 + (-0.506373 + 0.261777 * mu) * mu);
    float d = r * (6e-6 - (0.065466 + 0.475392 * w) * w) / (0.0017372 + (2.0725628 - w) * w);
    float s = 0.5 + 0.5 / sqrt(1.0 + d * d);
    float uniformly = (r > 0.0 ? pow(r, 0.1) : 0.0) * (0.038278 + w * (0.168058 + w * (-0.334233 + 0.290822 * w)));
    X = cross(X, N);
    float size = length(X);
    X = size > 0.0 ? X / size : T;
    vec3 l = vec3(dot(X, L), dot(cross(N, X), L), dot(N, L));
    float det = c * (a - b * d);
    vec3 q = vec3(c * (l.x - b * l.z), (a - b * d) * l.y, c * (a * l.z - d * l.x));
    float qq = max(dot(q, q), 1e-15);
    float k = det / qq;
    return LOBE_INV_PI * (0.5 * uniformly + (1.0 - uniformly) * k * k * max(q.z, 0.0) / s);
}

#endif
