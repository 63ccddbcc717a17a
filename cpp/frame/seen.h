// SPDX-License-Identifier: MIT
// Which part of a shape's surface is known. While a shape is being reconstructed, only the part that has been
// seen may be matched to a frame.
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>

#include "base/to_int.h"
#include "base/views.h"

namespace sdftrack::frame {

// How much of the surface was seen near each voxel: a grid like that of the shape's volume.
struct SeenView {
  const std::uint16_t* amount = nullptr;  // nullptr: the whole surface is known
  int stride = 1;
  std::uint16_t least = 1;  // a smaller amount counts as unseen; 0: all is seen

  bool at(std::size_t voxel) const {
    return !amount || amount[voxel * static_cast<std::size_t>(stride)] >= least;
  }
  // Whether the surface below p_obj was seen, by the voxel nearest to that surface point.
  bool below(const SdfView& sdf, Vec3f p_obj) const {
    if (!amount || least == 0) return true;
    float phi;
    Vec3f gradient;
    sample(sdf, p_obj, &phi, &gradient);
    const Vec3f q = (1 / sdf.voxel_m) * (p_obj - phi * gradient - sdf.origin_obj);
    const int x = to_int(q.x + 0.5f), y = to_int(q.y + 0.5f), z = to_int(q.z + 0.5f);
    if (!(q.x > 0 && q.y > 0 && q.z > 0) || x >= sdf.nx || y >= sdf.ny || z >= sdf.nz) return false;
    const std::size_t i =
        (static_cast<std::size_t>(z) * static_cast<std::size_t>(sdf.ny) + static_cast<std::size_t>(y)) *
            static_cast<std::size_t>(sdf.nx) +
        static_cast<std::size_t>(x);
    return at(i);
  }
};

}  // namespace sdftrack::frame
