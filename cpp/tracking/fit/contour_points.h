// SPDX-License-Identifier: MIT
// Where a shape ends as seen from a point: rays that just touch its field.
#pragma once

#include <cstdint>
#include <vector>

#include "base/camera.h"
#include "base/rigid.h"
#include "frame/shape.h"

namespace sdftrack::tracking {

// A point of the surface whose tangent plane holds the eye, and the outward normal there; centred frame.
struct ContourPoint {
  Vec3d p_obj, n_obj;
};

// Working memory.
struct ContourScratch {
  std::vector<Vec2d> rim, hull;
};

// About `wanted` points of the outer contour, in its order, from the origin of a pinhole camera. Rays start
// on the convex hull of the projected surface points, a little outside, and move towards the surface until
// they pass it within a few voxels; there the distance field is exact also at edges, which the volume itself
// rounds, and its foot is the contour's point. thickness_px: points where the object is thinner than this, or
// begins anew nearer than this outside, are left out.
void find_contour(const Intrinsics<double>& K, const frame::Shape& shape, const Rigidd& T_cam_obj, int wanted,
                  double thickness_px, ContourScratch* scratch, std::vector<ContourPoint>* out);

// Contours by the place of the eye, rounded: to two degrees of its direction and 15 % of its distance. The
// contour's point of a round surface slides as the eye moves, which takes the outline of the same point off
// by radius (angle)^2 / 2 alone, less than 2e-4 of the radius. The roundings do not depend on what has been
// seen before, so neither does a result.
class ContourLibrary {
 public:
  // Valid until the next call.
  const std::vector<ContourPoint>& seen_from(Vec3d eye_obj, const frame::Shape& shape, double focal_px,
                                             int wanted, double thickness_px);

 private:
  struct Entry {
    std::uint64_t shape;
    int cell, distance, wanted;
    double focal_px, thickness_px;
    std::vector<ContourPoint> points;
  };
  std::vector<Entry> entries_;
  std::size_t next_ = 0;  // to be replaced
  ContourScratch scratch_;
};

}  // namespace sdftrack::tracking
