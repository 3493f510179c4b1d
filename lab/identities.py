"""Identities between functions of the library, in GLSL. Those whose functions all exist are tested."""

# Over the domain of the first call on the left, within the units of all functions named. Fresnel's reversed path is
# tested where eta < 1, the half in which the rounding of cosT costs no more than the left's condition number tells; a share
# of a turn is turned back and mirrored where the difference is exact. Twice a quantile leaves the tail squared, whose
# rounding is tested where it costs little; angles whose half tangents are t and (1 - t)/(1 + t) add up to a right one.
LIMITS = """
    lobe_OrenNayar(N, V, L, albedo, 0.0) == lobe_Lambert(N, V, L, albedo)
    lobe_OrenNayar_qualitative(N, V, L, albedo, 0.0) == lobe_Lambert(N, V, L, albedo)
    lobe_OrenNayar_EON(N, V, L, albedo, 0.0) == lobe_Lambert(N, V, L, albedo)
    lobe_OrenNayar_EON_fast(N, V, L, albedo, 0.0) == lobe_Lambert(N, V, L, albedo)
    lobe_circle(0.0) == vec2(1.0, 0.0)
    lobe_circle(0.25) == vec2(0.0, 1.0)
    lobe_circle(0.5) == vec2(-1.0, 0.0)
    lobe_circle(0.75) == vec2(0.0, -1.0)
    lobe_circle(1.0) == vec2(1.0, 0.0)
    dot(lobe_circle(u), lobe_circle(u)) == 1.0
    lobe_circle(u) == vec2(-1.0, 1.0) * lobe_circle(u - 0.25).yx where u >= 0.25
    lobe_circle(u) == vec2(1.0, -1.0) * lobe_circle(1.0 - u) where u >= 0.5
    lobe_quantile_exponential(0.0) == 0.0
    lobe_quantile_exponential(0.5) == 0.69314718
    2.0 * lobe_quantile_exponential(u) == lobe_quantile_exponential(u * (2.0 - u)) where u <= 0.5
    lobe_angle_of_half(0.0) == 0.0
    lobe_angle_of_half(0.41421356) == 0.78539816
    lobe_angle_of_half(1.0) == 1.57079633
    lobe_angle_of_half(tanHalf) + lobe_angle_of_half((1.0 - tanHalf) / (1.0 + tanHalf)) == 1.57079633
    lobe_F_dielectric(cosI, 1.0) == 0.0
    lobe_F_dielectric(0.0, 1.0) == 0.0
    lobe_T_dielectric(cosI, 1.0) == 1.0
    lobe_F_dielectric(0.0, eta) == 1.0 where eta != 1.0
    lobe_F_dielectric(1.0, eta) == lobe_f0(eta)
    lobe_F_dielectric(cosI, eta) + lobe_T_dielectric(cosI, eta) == 1.0
    lobe_F_dielectric(cosI, eta) == lobe_F_dielectric(lobe_cosT(cosI, eta), 1.0 / eta) where eta < 1.0
    lobe_F_dielectric(cosI, eta) == 0.5 * dot(lobe_F_dielectric_sp(cosI, eta), vec2(1.0))
    lobe_F_dielectric_sp(cosI, eta) + lobe_T_dielectric_sp(cosI, eta) == 1.0
    lobe_F_conductor(cosI, eta, 0.0) == lobe_F_dielectric(cosI, eta)
    lobe_F_conductor_sp(cosI, eta, 0.0) == lobe_F_dielectric_sp(cosI, eta)
    lobe_F_conductor(cosI, eta, k) == 0.5 * dot(lobe_F_conductor_sp(cosI, eta, k), vec2(1.0))
    lobe_F_conductor(1.0, eta, k) == lobe_f0(eta, k)
    lobe_F_conductor(cosI, 1.0, 0.0) == 0.0
    lobe_F_conductor(0.0, 1.0, 0.0) == 0.0
    lobe_F_Schlick(1.0, f0) == f0
    lobe_F_Schlick(0.0, f0) == 1.0
    lobe_F_Schlick(0.0, f0, f90) == f90
    lobe_F_Schlick(cosI, f0, 1.0) == lobe_F_Schlick(cosI, f0)
    lobe_F_F82(1.0, f0, f82) == f0
    lobe_F_F82(0.14285714, f0, f82) == f82
    lobe_F_F82(0.0, f0, f82) == 1.0
    lobe_F_F82_tint(1.0, f0, tint) == f0
    lobe_F_F82_tint(cosI, f0, 1.0) == lobe_F_Schlick(cosI, f0)
    lobe_F_F82_tint(0.0, f0, tint) == 1.0
    lobe_F_Hall(1.0, f0, eta0) == f0
    lobe_F_Hall(0.0, f0, eta0) == 1.0 where eta0 != 1.0
    lobe_V_GGX_aniso(NdotV, NdotL, TdotV, BdotV, TdotL, BdotL, alphaX, alphaX) == lobe_V_GGX(NdotV, NdotL, alphaX)
    lobe_GGX_aniso(N, T, V, L, f0, alphaX, alphaX) == lobe_GGX(N, V, L, f0, alphaX)
    lobe_GGX_conductor(N, V, L, 1.0, 0.0, alpha) == 0.0
    lobe_V_GGX(NdotV, NdotL, alpha) * (4.0 * NdotV * NdotL) == lobe_G2_GGX(NdotV, NdotL, alpha)
    lobe_V_GGX_separable(NdotV, NdotL, alpha) * (4.0 * NdotV * NdotL) == lobe_G2_GGX_separable(NdotV, NdotL, alpha)
    lobe_V_Beckmann(NdotV, NdotL, alpha) * (4.0 * NdotV * NdotL) == lobe_G2_Beckmann(NdotV, NdotL, alpha)
    lobe_V_Vgroove(NdotV, NdotL, NdotH, VdotH) * (4.0 * NdotV * NdotL) == lobe_G_Vgroove(NdotV, NdotL, NdotH, VdotH)
    lobe_G2_GGX_separable(NdotV, NdotL, alpha) == lobe_G1_GGX(NdotV, alpha) * lobe_G1_GGX(NdotL, alpha)
    lobe_G2_GGX(NdotV, 1.0, alpha) == lobe_G1_GGX(NdotV, alpha)
    lobe_G2_Beckmann(NdotV, 1.0, alpha) == lobe_G1_Beckmann(NdotV, alpha)
    lobe_G1_GGX(NdotX, 0.0) == 1.0
    lobe_Z_Schlick(NdotH, r) == 3.14159265 * lobe_D_GGX(NdotH, sqrt(r))
    lobe_peak_Gaussian(alpha) == lobe_D_Gaussian_normalized(1.0, alpha)
    lobe_peak_Gaussian(0.0001) == 31830990.0
    lobe_G1_Schlick(NdotX, 0.0) == 1.0 where NdotX > 0.0
    lobe_AshikhminShirley_diffuse(N, V, L, rd, 1.0) == vec3(0.0)
    lobe_GGX_blend(N, V, L, f0, alphas, 0.0) == lobe_GGX(N, V, L, f0, alphas.x)
    lobe_GGX_blend_D(N, V, L, f0, alphas, 1.0) == lobe_GGX(N, V, L, f0, alphas.y)
    lobe_CookTorrance_blend(N, V, L, f0, alphas, 0.0) == lobe_CookTorrance(N, V, L, f0, alphas.x)
    lobe_pdf_GGX_aniso(N, T, V, L, alphaX, alphaX) == lobe_pdf_GGX(N, V, L, alphaX)
    lobe_pdf_Ward(N, T, V, L, alphaX, alphaX) == lobe_pdf_Beckmann(N, V, L, alphaX)
"""

# The directional albedo of the left equals the right, for white colours: from every view, or only from straight above.
ALBEDOS = """
    lobe_Lambert(N, V, L, albedo) == 1.0
    lobe_GGX(N, V, L, f0, 1.0) - lobe_GGX_Kelemen(N, V, L, f0, 1.0) == 0.0
    lobe_GGX(N, V, L, f0, alpha) == lobe_albedo_GGX(NdotV, alpha)
    lobe_GGX(N, V, L, f0, alpha) + lobe_GGX_multiple(N, V, L, f0, alpha) == 1.0
    lobe_GGX(N, V, L, f0, alpha) * lobe_energy_Turquin(NdotV, f0, alpha) == 1.0
    lobe_OrenNayar_EON(N, V, L, albedo, roughness) == 1.0
    lobe_OrenNayar_EON(N, V, L, vec3(0.5), roughness) == lobe_albedo_EON(NdotV, vec3(0.5), roughness)
    lobe_OrenNayar_EON_fast(N, V, L, vec3(0.5), roughness) == lobe_albedo_EON_fast(NdotV, vec3(0.5), roughness)
    lobe_Phong(N, V, L, rs, exponent) == 1.0 from above
    lobe_BlinnPhong(N, V, L, rs, exponent) == 1.0 from above
"""
