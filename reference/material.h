// A material: lobes with their parameters, summed, and what reflects or refracts into one direction only.
#pragma once

#include "proposal.h"
#include "registry.h"

#include <array>
#include <map>
#include <optional>
#include <string>
#include <vector>

namespace lobe {

// One lobe, its arguments packed; only the vectors change from hit to hit. Not for several threads at once: copy it.
class Lobe {
public:
    using Parameters = std::map<std::string, std::vector<double>>;

    // Throws std::invalid_argument, naming what is known, where the key or a parameter is unknown or one is missing.
    Lobe(const std::string& key, const Parameters& parameters);

    void turn(const Vec3& N, const Vec3& T, const Vec3& V) { write(N, N_), write(T, T_), write(V, V_); }
    // f in 1/sr towards V for light from L; a lobe of one float is grey.
    Vec3 operator()(const Vec3& L) {
        write(L, L_);
        double f[3];
        call_(arguments_.data(), f);
        return grey_ ? Vec3(f[0]) : Vec3(f[0], f[1], f[2]);
    }

    // How its directions are drawn. A model may bring its own; at first it is the one, of those that its parameters
    // suggest, under which f cos / density varies least.
    Proposal proposal = Proposal::cosine();
    // About its directional albedo, the weight with which it is drawn from. Above 0, so that no light is missed.
    double albedo(double NdotV) const;

    bool turned() const { return turned_; }  // takes a tangent
    bool uniform() const { return uniform_; }  // does not depend on V above the horizon
    std::uint64_t fingerprint() const;

private:
    static constexpr int ANGLES = 8;  // cosines (i + 1/2) / ANGLES

    void write(const Vec3& v, std::size_t at) {
        double* p = arguments_.data() + at;
        p[0] = v.x, p[1] = v.y, p[2] = v.z;
    }
    void choose(const std::vector<Proposal>& candidates);

    std::string key_;
    void (*call_)(const double*, double*);
    bool grey_, turned_, uniform_;
    std::vector<double> arguments_;  // and behind them room for the vectors that the lobe does not take
    std::size_t N_, T_, V_, L_;      // where they are written
    std::array<double, ANGLES> albedo_{};
};

// An ideal mirror: a dielectric's or metal's Fresnel reflectance, exact or Schlick's.
struct Mirror {
    std::optional<Vec3> f0;  // Schlick's
    Vec3 eta{1}, k{0};       // else the exact one

    Vec3 reflectance(double cosI) const;
};

// An ideal boundary between dielectrics; N points out of the one whose index over the other's is eta.
struct Glass {
    double eta;
};

enum Way { MIRROR, REFLECTION, REFRACTION };  // in which light goes on without being scattered

struct Material {
    std::vector<Lobe> lobes;
    std::optional<Mirror> mirror;
    std::optional<Glass> glass;

    // Whether light leaves it to all directions alike.
    bool uniform() const { return lobes.size() == 1 && lobes.front().uniform() && !mirror && !glass; }
};

// What mirror and glass of a material send on of the light that V looks at.
struct Ideal {
    Ideal() = default;
    Ideal(const Material& m, double NdotV);
    // Where that light comes from.
    Vec3 L(Way way, const Vec3& N, const Vec3& V) const;

    double NdotV = 0;
    Vec3 mirror{0};
    double reflected = 0, refracted = 0, eta = 1;  // by glass; index of the far side over that of V's
};

}  // namespace lobe
