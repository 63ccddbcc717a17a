// SPDX-License-Identifier: MIT
// The cost of a pixel next to an object's outline.
#pragma once

#include "energies/penalty.h"

namespace sdftrack::primitives {

// A pixel's ray hits the solid with the probability ("chance") 1 / (1 + e^(d / s)) at the clearance d:
//   C(d) = -log((1 - e) chance + e / 2),
// as a majorising quadratic like that of DepthLogistic, and its second derivative. `side`: 1 if the pixel
// shows the object, -1 if not.
template <class T>
struct OutlineCost {
  energies::Curve<T> curve;
  T second;
};

template <class T>
HD OutlineCost<T> outline_cost(T d, T s, T floor, T side) {
  using sdftrack::abs;  // sdftrack::primitives also has one
  const T x = side * d / s;
  const T size = select(abs(x) > T(50), T(50), abs(x));  // beyond, the smaller probability is below rounding
  const T small = exp_negative(-size), up = T(1) + small;
  const auto misses = x > T(0);
  const T chance = select(misses, small, T(1)) / up, other = select(misses, T(1), small) / up;
  const T likelihood = (T(1) - floor) * chance + T(0.5) * floor;
  const T mine = (T(1) - floor) * chance / likelihood, others = T(0.5) * floor / likelihood;
  const T slope = mine * other / s;
  const auto near = size < T(2e-4);
  const T tanh_per_u = select(near, T(1), T(2) * (T(1) - small) / (up * select(near, T(1), abs(x))));
  return {{-log_positive(likelihood), side * slope, mine * tanh_per_u / (T(4) * s * s)},
          mine * other * (chance - other * others) / (s * s)};
}

}  // namespace sdftrack::primitives
