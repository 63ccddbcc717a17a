// SPDX-License-Identifier: MIT
// The lattice of a volume: voxel centre (ix, iy, iz) is at origin_obj + voxel_m * (ix, iy, iz).
#pragma once

#include <cstddef>
#include <vector>

#include "base/vec.h"
#include "base/views.h"

namespace sdftrack::sdf {

struct Grid {
  int nx, ny, nz;
  double voxel_m;
  Vec3d origin_obj;

  HD std::size_t size() const {
    return static_cast<std::size_t>(nx) * static_cast<std::size_t>(ny) * static_cast<std::size_t>(nz);
  }
  HD std::size_t index(int ix, int iy, int iz) const {
    return (static_cast<std::size_t>(iz) * static_cast<std::size_t>(ny) + static_cast<std::size_t>(iy)) *
               static_cast<std::size_t>(nx) +
           static_cast<std::size_t>(ix);
  }
  HD Vec3d point(int ix, int iy, int iz) const {
    return {origin_obj.x + voxel_m * ix, origin_obj.y + voxel_m * iy, origin_obj.z + voxel_m * iz};
  }
  SdfView view(const float* phi) const {
    return {phi, nx, ny, nz, static_cast<float>(voxel_m), origin_obj.cast<float>()};
  }
};

}  // namespace sdftrack::sdf
