// SPDX-License-Identifier: MIT
// Free space: where frames have seen past, the object cannot be (docs/math/reconstruction.md, section 5).
#pragma once

#include "base/to_int.h"
#include "levelset/evidence_terms.h"
#include "sdf/grid.h"

namespace sdftrack::levelset {

constexpr float kEmptyFrames = 3;     // least weight, in frames, and
constexpr float kEmptyRatio = -1.5f;  // greatest mean where the object cannot be

// Whether frames have seen past the voxel nearest to a point, if it is farther than near_m from the surface.
HD bool looked_past(const sdf::Grid& grid, const float* phi, const float* log_ratio, const float* weight,
                    Vec3d p_obj, float near_m) {
  const Vec3d at = (1 / grid.voxel_m) * (p_obj - grid.origin_obj) + Vec3d{0.5, 0.5, 0.5};
  const int x = to_int(std::floor(at.x)), y = to_int(std::floor(at.y)), z = to_int(std::floor(at.z));
  if (x < 0 || y < 0 || z < 0 || x >= grid.nx || y >= grid.ny || z >= grid.nz) return false;
  const std::size_t voxel = grid.index(x, y, z);
  return phi[voxel] > near_m && weight[voxel] > kEmptyFrames * kCarvedWeight &&
         log_ratio[voxel] < kEmptyRatio * weight[voxel];
}

}  // namespace sdftrack::levelset
