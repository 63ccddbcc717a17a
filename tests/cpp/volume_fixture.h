// SPDX-License-Identifier: MIT
// Analytic shapes sampled on a grid: test data made in code.
#pragma once

#include <algorithm>
#include <cmath>
#include <functional>
#include <vector>

#include "base/views.h"

namespace sdftrack {

struct Volume {
  std::vector<float> phi;
  int n;
  float voxel_m;
  Vec3f origin;

  SdfView view() const { return {phi.data(), n, n, n, voxel_m, origin}; }
};

// A cube of n^3 voxels with the given half side, about the origin.
inline Volume make_volume(int n, double half_m, const std::function<double(Vec3d)>& distance) {
  Volume v{{}, n, static_cast<float>(2 * half_m / (n - 1)), {}};
  const auto low = static_cast<float>(-half_m);
  v.origin = {low, low, low};
  v.phi.reserve(static_cast<std::size_t>(n) * n * n);
  for (int z = 0; z < n; ++z)
    for (int y = 0; y < n; ++y)
      for (int x = 0; x < n; ++x) {
        const double step = v.voxel_m;
        v.phi.push_back(
            static_cast<float>(distance({-half_m + step * x, -half_m + step * y, -half_m + step * z})));
      }
  return v;
}

inline double box_distance(Vec3d p, Vec3d half) {
  const Vec3d q{std::abs(p.x) - half.x, std::abs(p.y) - half.y, std::abs(p.z) - half.z};
  const Vec3d outside{std::max(q.x, 0.0), std::max(q.y, 0.0), std::max(q.z, 0.0)};
  return norm(outside) + std::min(0.0, std::max({q.x, q.y, q.z}));
}

}  // namespace sdftrack
