// SPDX-License-Identifier: MIT
// The lattice of a volume: voxel centre (ix, iy, iz) is at origin_obj + voxel_m * (ix, iy, iz).
#pragma once

#include <cstddef>

#include "base/vec.h"
#include "base/views.h"

namespace sdftrack::sdf {

struct Grid {
  int nx, ny, nz;
  double voxel_m;
  Vec3d origin_obj;

  HD std::size_t size() const { return std::size_t(nx) * ny * nz; }
  HD std::size_t index(int ix, int iy, int iz) const { return (std::size_t(iz) * ny + iy) * nx + ix; }
  HD Vec3d point(int ix, int iy, int iz) const {
    return {origin_obj.x + voxel_m * ix, origin_obj.y + voxel_m * iy, origin_obj.z + voxel_m * iz};
  }
  SdfView view(const float* phi) const { return {phi, nx, ny, nz, float(voxel_m), origin_obj.cast<float>()}; }
};

}  // namespace sdftrack::sdf
