// Masking and shadowing that know no distribution: V-shaped grooves, and Kelemen's approximation of them.
#pragma once

#include "core.h"

namespace lobe {

// Torrance, Sparrow 1967, in the vector form of Blinn 1977: the part of a groove's facet that is neither masked from V,
// 2 NdotH NdotV / VdotH, nor shadowed from L, 2 NdotH NdotL / VdotH. 0 when the surface is seen or lit edge-on.
inline double lobe_G_Vgroove(double NdotV, double NdotL, double NdotH, double VdotH) {
    const double free = 2 * clamp_cosine(NdotH) * std::min(clamp_cosine(NdotV), clamp_cosine(NdotL));
    return free > 0 ? std::min(1.0, free / clamp_cosine(VdotH)) : 0;
}

// G / (4 NdotV NdotL), each of the three cases of G (free, masked, shadowed) divided before the smallest is taken: it
// stays finite where G and a cosine vanish together.
inline double lobe_V_Vgroove(double NdotV, double NdotL, double NdotH, double VdotH) {
    const double v = std::max(clamp_cosine(NdotV), SMALLEST_COSINE), l = std::max(clamp_cosine(NdotL), SMALLEST_COSINE);
    const double facet = clamp_cosine(NdotH) / (2 * std::max(clamp_cosine(VdotH), SMALLEST_COSINE));
    return std::min({1 / (4 * v * l), facet / l, facet / v});
}

// Kelemen, Szirmay-Kalos 2001: G / (NdotV NdotL) is about 1 / LdotH^2.
inline double lobe_V_Kelemen(double LdotH) {
    const double c = std::max(clamp_cosine(LdotH), SMALLEST_COSINE);
    return 1 / (4 * c * c);
}
inline double lobe_V_Kelemen(Vec3 V, Vec3 L) { return lobe_V_Kelemen(lobe_LdotH(V, L)); }

// Neumann, Neumann, Szirmay-Kalos 1999: of the foreshortened surface the smaller of the two cosines is seen and lit,
// G = min(NdotV, NdotL).
inline double lobe_V_Neumann(double NdotV, double NdotL) {
    const double v = std::max(clamp_cosine(NdotV), SMALLEST_COSINE), l = std::max(clamp_cosine(NdotL), SMALLEST_COSINE);
    return std::min(v, l) / (4 * v * l);
}

LOBE_MODEL(masking,
           LOBE_FUNCTION(double, lobe_G_Vgroove, (double NdotV, double NdotL, double NdotH, double VdotH)),
           LOBE_FUNCTION(double, lobe_V_Vgroove, (double NdotV, double NdotL, double NdotH, double VdotH)),
           LOBE_FUNCTION(double, lobe_V_Kelemen, (double LdotH)),
           LOBE_FUNCTION(double, lobe_V_Kelemen, (Vec3 V, Vec3 L)),
           LOBE_FUNCTION(double, lobe_V_Neumann, (double NdotV, double NdotL)))

}  // namespace lobe
