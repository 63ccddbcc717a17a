// SPDX-License-Identifier: MIT
// The distance of a solid at a point, with derivatives.
#pragma once

#include "base/vec.h"

namespace sdftrack::sdf {

constexpr int kMaxSizes = 3;  // lengths of a solid

template <class T>
struct SolidSample {
  T phi_m;
  Vec3<T> grad;       // d phi / d p, object frame
  T size[kMaxSizes];  // d phi / d lengths
};

}  // namespace sdftrack::sdf
