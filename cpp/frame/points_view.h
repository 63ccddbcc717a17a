// SPDX-License-Identifier: MIT
// A list of points as a loop sees it.
#pragma once

#include "base/vec.h"

namespace sdftrack::frame {

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

}  // namespace sdftrack::frame
