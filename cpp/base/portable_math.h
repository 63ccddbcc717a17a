// SPDX-License-Identifier: MIT
// In place of functions whose last bit differs between the C libraries of two processors (std::hypot,
// std::erf): results are the same bits on x86-64 and on 64-bit ARM.
#pragma once

#include <cmath>
#include <numbers>

namespace sdftrack {

// sqrt(a^2 + b^2), without hypot's care for numbers near the limits of double.
inline double hypotenuse(double a, double b) { return std::sqrt(a * a + b * b); }

// erf(x) = 2 x / sqrt(pi) e^(-x^2) sum over n of (2 x^2)^n / (1 3 5 ... (2 n + 1)): all terms are positive,
// so that nothing cancels.
inline double error_function(double x) {
  if (!(std::abs(x) < 6)) return std::isnan(x) ? x : std::copysign(1.0, x);
  double term = 1, sum = 1;
  for (int n = 1; term > 1e-17 * sum; ++n) term *= 2 * x * x / (2 * n + 1), sum += term;
  return 2 * std::numbers::inv_sqrtpi * x * std::exp(-x * x) * sum;
}

}  // namespace sdftrack
