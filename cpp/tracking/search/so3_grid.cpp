// SPDX-License-Identifier: MIT
#include "tracking/search/so3_grid.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

#include "base/to_int.h"

namespace sdftrack::tracking {

Mat3d super_fibonacci(int i, int n) {
  constexpr double kPsi = 1.533751168755204288118041;  // root of psi^4 = psi + 4
  const double s = i + 0.5, t = s / n, turn = 2 * std::numbers::pi * s;
  const double r = std::sqrt(t), R = std::sqrt(1 - t);
  const double a = turn / std::numbers::sqrt2, b = turn / kPsi;
  return rotation_from_quaternion({R * std::cos(b), r * std::sin(a), r * std::cos(a), R * std::sin(b)});
}

// Of all strides for n = 240, the one whose runs of 60 leave the smallest gap, 57 degrees (random strides: up
// to 80).
constexpr double kStride = 0.471;

Mat3d seed_rotation(int k, int n) {
  int stride = to_int(kStride * n);
  while (stride > 1 && std::gcd(stride, n) != 1) --stride;
  const auto i = (static_cast<long long>(k) * std::max(1, stride)) % n;
  return super_fibonacci(static_cast<int>(i), n);
}

}  // namespace sdftrack::tracking
