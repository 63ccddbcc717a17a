// SPDX-License-Identifier: MIT
// The distance of a voxel next to the surface (docs/math/reconstruction.md, section 3).
#pragma once

#include "levelset/eikonal_terms.h"

namespace sdftrack::levelset {

// Sums over the frames, by voxel; the mean log ratio follows from both.
struct RatioView {
  const float *log_ratio, *weight;

  HD float mean(std::size_t i) const { return weight[i] > 0 ? log_ratio[i] / weight[i] : log_ratio[i]; }
};

// Where the mean log ratio changes its sign between two voxels, the surface lies at the zero of the line
// through both. Returns the distance of voxel i to the plane through these points. row, slice: offsets along
// y and z.
HD float crossing_distance(const RatioView& evidence, std::size_t i, std::size_t row, std::size_t slice,
                           float voxel_m) {
  const float own = evidence.mean(i);
  float sum = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const std::size_t step = axis == 0 ? 1 : axis == 1 ? row : slice;
    float nearest = 2;  // in voxels; beyond 1: no crossing along this axis
    for (int side = 0; side < 2; ++side) {
      const float other = evidence.mean(side ? i + step : i - step);
      if ((other > 0) == (own > 0)) continue;
      nearest = least(abs(own) / most(1e-20f, abs(own) + abs(other)), nearest);
    }
    if (nearest <= 1) sum += 1 / most(nearest * nearest, 1e-8f);
  }
  const float distance = voxel_m / sqrt(most(sum, 1.0f));
  return own > 0 ? -distance : distance;
}

// A voxel's change counts as motion of the surface if the voxel was nearer to it than this, in voxels.
constexpr float kMoveWithin = 2;

}  // namespace sdftrack::levelset
