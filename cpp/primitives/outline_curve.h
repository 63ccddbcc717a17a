// SPDX-License-Identifier: MIT
// What a pixel beside the edge of an object's picture costs.
#pragma once

#include "energies/penalty.h"

namespace sdftrack::primitives {

// A pixel's ray hits the solid or not, with the chance 1 / (1 + e^(d / s)) at the clearance d:
//   C(d) = -log((1 - e) chance + e / 2),
// as a majorised quadratic like that of DepthLogistic, and its second derivative. `side`: 1 if the object is
// seen there, -1 if not.
template <class T>
struct OutlineCost {
  energies::Curve<T> curve;
  T second;
};

template <class T>
HD OutlineCost<T> outline_cost(T d, T s, T floor, T side) {
  using sdftrack::abs;  // primitives has one of its own
  const T x = side * d / s;
  const T size = select(abs(x) > T(50), T(50), abs(x));  // beyond it nothing is left of the lesser chance
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
