// SPDX-License-Identifier: MIT
// What a pixel beside the edge of an object's picture costs.
#pragma once

#include <algorithm>
#include <cmath>

#include "energies/penalty.h"

namespace sdftrack::primitives {

// A pixel's ray hits the solid or not, with the chance 1 / (1 + e^(d / s)) at the clearance d:
//   -log((1 - e) chance + e / 2), as a majorised quadratic like that of DepthLogistic.
inline energies::Curve<double> outline_curve(double d, double s, double floor, bool on) {
  const double x = (on ? d : -d) / s;
  const double chance = 1 / (1 + std::exp(std::clamp(x, -50.0, 50.0)));
  const double likelihood = (1 - floor) * chance + 0.5 * floor;
  const double mine = (1 - floor) * chance / likelihood;
  const double slope = mine * (1 - chance) / s;
  const double u = 0.5 * std::abs(x);
  const double touching = mine * (u > 1e-4 ? std::tanh(u) / u : 1.0) / (4 * s * s);
  return {-std::log(likelihood), on ? slope : -slope, touching};
}

// d^2 cost / d d^2 of it.
inline double outline_second(double d, double s, double floor, bool on) {
  const double h = 1e-3 * s;
  return (outline_curve(d + h, s, floor, on).slope - outline_curve(d - h, s, floor, on).slope) / (2 * h);
}

}  // namespace sdftrack::primitives
