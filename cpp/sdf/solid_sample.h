// SPDX-License-Identifier: MIT
// The distance of a solid at a point, with derivatives.
#pragma once

#include "base/vec.h"

namespace sdftrack::sdf {

constexpr int kMaxLengths = 3;  // of a solid
constexpr int kMaxSizes = 5;    // its lengths, then the exponents of a superquadric

// N: the sizes that have a derivative; most solids have no more than three.
template <class T, int N = kMaxLengths>
struct SolidSample {
  static constexpr int kSizes = N;

  T phi_m;
  Vec3<T> grad;  // d phi / d p, object frame
  T size[N];     // d phi / d sizes
};

}  // namespace sdftrack::sdf
