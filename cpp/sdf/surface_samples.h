// SPDX-License-Identifier: MIT
// Points spread over the zero set of a volume.
#pragma once

#include <functional>
#include <vector>

#include "base/views.h"
#include "sdf/zero_set.h"

namespace sdftrack::sdf {

struct SurfaceSample {
  Vec3f p_obj;  // m, on the zero set of the trilinear interpolant
  Vec3f n_obj;  // unit, outwards
};

// The zero set as triangles: found once, sampled repeatedly. The volume's values must live as long.
class ZeroSurface {
 public:
  explicit ZeroSurface(const SdfView& sdf);
  double area_m2() const;
  // `count` points (fewer only where a field has creases on its surface, none where it has no zero set), with
  // the same density everywhere, always the same ones.
  std::vector<SurfaceSample> samples(int count) const;

 private:
  SdfView sdf_;
  std::vector<Triangle> triangles_;  // voxels
  double area_vox_ = 0;
};

// Voxels [x0, x1) x [y0, y1) x [z0, z1) of a volume.
struct VoxelBox {
  int x0, y0, z0, x1, y1, z1;
};

// At most `count` points of the zero set, each from a voxel of the boxes within half a voxel of the surface
// for which `requested(index)` is true. Nearly uniform density, in scrambled order: any part of them is
// spread as evenly. Faster than ZeroSurface, for a volume that keeps changing.
std::vector<SurfaceSample> sample_near(const SdfView& sdf, const std::vector<VoxelBox>& boxes,
                                       const std::function<bool(std::size_t voxel)>& requested, int count);

}  // namespace sdftrack::sdf
