// SPDX-License-Identifier: MIT
#include "tracking/shape.h"

#include <algorithm>
#include <limits>
#include <stdexcept>

#include "sdf/surface_samples.h"

namespace sdftrack {

namespace {

struct Box {
  float low[3], high[3];  // voxels
};

// The ball of radius |phi| about a point inside lies inside, and such balls reach the surface on every side:
// their extent is the object's, to a small part of a voxel.
Box box_of_inside(const SdfView& sdf) {
  constexpr float kFar = std::numeric_limits<float>::max();
  Box box{{kFar, kFar, kFar}, {-kFar, -kFar, -kFar}};
  const float* row = sdf.phi;
  for (int z = 0; z < sdf.nz; ++z)
    for (int y = 0; y < sdf.ny; ++y, row += sdf.nx)
      for (int x = 0; x < sdf.nx; ++x)
        if (row[x] <= 0) {
          const float at[3] = {static_cast<float>(x), static_cast<float>(y), static_cast<float>(z)};
          const float radius = -row[x] / sdf.voxel_m;
          for (int a = 0; a < 3; ++a) {
            box.low[a] = std::min(box.low[a], at[a] - radius);
            box.high[a] = std::max(box.high[a], at[a] + radius);
          }
        }
  if (box.high[0] < box.low[0])
    throw std::invalid_argument(
        "shape: the field has no inside (no value <= 0); distances are negative inside");
  return box;
}

}  // namespace

Shape make_shape(const SdfView& sdf, int point_count, int outline_count) {
  const Box box = box_of_inside(sdf);
  const double voxel = sdf.voxel_m;
  double centre[3], half[3];
  const Vec3d origin = sdf.origin_obj.cast<double>();
  const double o[3] = {origin.x, origin.y, origin.z};
  for (int a = 0; a < 3; ++a) {
    centre[a] = o[a] + 0.5 * voxel * (box.low[a] + box.high[a]);
    half[a] = 0.5 * voxel * (box.high[a] - box.low[a]);
  }
  Shape shape{sdf, {centre[0], centre[1], centre[2]}, {half[0], half[1], half[2]}, 0, {}, {}, {}};
  shape.diameter_m = 2 * norm(shape.half_box_m);
  shape.sdf.origin_obj = (origin - shape.centre_obj).cast<float>();
  for (const SurfaceSample& s : surface_samples(shape.sdf, point_count)) {
    shape.points.push_back(s.p_obj);
    shape.normals.push_back(s.n_obj);
  }
  const std::size_t n = shape.points.size(),
                    m = std::min(n, static_cast<std::size_t>(std::max(0, outline_count)));
  for (std::size_t k = 0; k < m; ++k) shape.outline.push_back(shape.points[k * n / m]);
  return shape;
}

}  // namespace sdftrack
