// Integrals that no closed form is asked for.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numbers>
#include <utility>

namespace lobe {

// Nodes and weights of Gauss, Legendre on 0..1: the roots of P_n by Newton from Tricomi's guess.
template <int n> struct GaussLegendre {
    GaussLegendre() {
        for (int i = 0; i < n; ++i) {
            double x = std::cos(std::numbers::pi * (i + 0.75) / (n + 0.5)), slope = 0;
            for (int step = 0; step < 6; ++step) {
                double p = 1, before = 0;
                for (int k = 1; k <= n; ++k) before = std::exchange(p, ((2 * k - 1) * x * p - (k - 1) * before) / k);
                slope = n * (x * p - before) / (x * x - 1);
                x -= p / slope;
            }
            node[i] = (1 + x) / 2, weight[i] = 1 / ((1 - x * x) * slope * slope);
        }
    }
    std::array<double, n> node, weight;
};

// The integral of f from 0 to end; f smooth.
template <int nodes, class F> double integral(double end, F f) {
    static const GaussLegendre<nodes> gauss;
    double sum = 0;
    for (std::size_t i = 0; i < nodes; ++i) sum += f(end * gauss.node[i]) * gauss.weight[i];
    return end * sum;
}

// f(x), kept for the next time: a picture asks for the same parameter again and again. One memory for each F.
template <class F> double remembered(double x, F f) {
    thread_local double before = std::numeric_limits<double>::quiet_NaN(), value = 0;
    if (std::exchange(before, x) != x) value = f(x);
    return value;
}

}  // namespace lobe
