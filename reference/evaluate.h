// Values and condition numbers of a function over many inputs.
#pragma once

#include "registry.h"

#include <span>

namespace lobe {

// N, V and L brought to unit length and T made orthogonal to N, in place: the inputs as the reference understands them,
// whatever float rounding did to their length. A null vector stays as it is. H may have any length and is left alone.
void normalize_directions(const Function& f, std::span<double> arguments);

// results[i] = f(arguments[i]) for rows of argument_width and result_width doubles, directions normalised. Parallel.
void evaluate(const Function& f, std::span<const double> arguments, std::span<double> results);

// Condition number kappa = sum_i |x_i df/dx_i| / |f| over the components of all inputs, for each component of the result.
// Each input moves by one float rounding, 2^-24 of itself, to both sides; the steeper side counts, so that the edge of a
// domain and a kink do not halve it. 0 where f is 0. Directions are normalised before and after the step. Parallel.
void condition(const Function& f, std::span<const double> arguments, std::span<double> kappa);

}  // namespace lobe
