// SPDX-License-Identifier: MIT
// View of a list of points, for loops and kernels.
#pragma once

#include "base/vec.h"

namespace sdftrack::energies {

// Every stride-th of n points.
struct PointsView {
  const Vec3f* points = nullptr;
  int n = 0, stride = 1;

  HD int count() const { return (n + stride - 1) / stride; }
  template <class T>
  HD Vec3<T> at(IntOf<T> k) const {
    return gather<T>(points, k * stride);
  }
};

}  // namespace sdftrack::energies
