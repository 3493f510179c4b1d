// A material: lobes with their parameters, summed.
#pragma once

#include "registry.h"

#include <map>
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

private:
    void write(const Vec3& v, std::size_t at) {
        double* p = arguments_.data() + at;
        p[0] = v.x, p[1] = v.y, p[2] = v.z;
    }

    void (*call_)(const double*, double*);
    bool grey_;
    std::vector<double> arguments_;  // and behind them room for the vectors that the lobe does not take
    std::size_t N_, T_, V_, L_;      // where they are written
};

using Material = std::vector<Lobe>;

}  // namespace lobe
