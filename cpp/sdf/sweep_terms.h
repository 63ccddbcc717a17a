// SPDX-License-Identifier: MIT
// A node of the sweep for |grad u| = 1.
#pragma once

#include "base/lane.h"

namespace sdftrack::sdf {

constexpr float kUnreached = 1e30f;

// Smallest u with sum over axes of max(u - a_i, 0)^2 = h^2, for the smaller neighbour a_i of each axis.
HD float godunov(float a, float b, float c, float h) {
  const auto less = [](float x, float y) { return y < x ? y : x; };
  const auto more = [](float x, float y) { return x < y ? y : x; };
  const float low = less(a, less(b, c)), high = more(a, more(b, c));
  const float middle = more(less(a, b), less(more(a, b), c));
  float u = low + h;
  if (u > middle) {
    const float d = middle - low;
    u = 0.5f * (low + middle + sqrt(2 * h * h - d * d));
    if (u > high) {
      // Relative to the lowest value, so that large distances lose no digits.
      const float p = middle - low, q = high - low, s = p + q;
      u = low + (s + sqrt(more(0.f, s * s - 3 * (p * p + q * q - h * h)))) / 3;
    }
  }
  return u;
}

}  // namespace sdftrack::sdf
