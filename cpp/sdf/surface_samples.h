// SPDX-License-Identifier: MIT
// Points spread over the zero set of a volume.
#pragma once

#include <vector>

#include "base/views.h"
#include "sdf/zero_set.h"

namespace sdftrack {

struct SurfaceSample {
  Vec3f p_obj;  // m, on the zero set of the trilinear interpolant
  Vec3f n_obj;  // unit, outwards
};

// The zero set as triangles: found once, sampled as often as is wanted. The volume's values must live as
// long.
class ZeroSurface {
 public:
  explicit ZeroSurface(const SdfView& sdf);
  double area_m2() const;
  // `count` points (fewer only where a field has creases on its surface, none where it has no zero set), as
  // many per area everywhere, always the same ones.
  std::vector<SurfaceSample> samples(int count) const;

 private:
  SdfView sdf_;
  std::vector<Triangle> triangles_;  // voxels
  double area_vox_ = 0;
};

}  // namespace sdftrack
