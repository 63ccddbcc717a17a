// SPDX-License-Identifier: MIT
// The dominant plane of a depth image: a table or a floor (thesis, section 3.8.3).
#pragma once

#include <algorithm>
#include <optional>
#include <vector>

#include "tracking/region.h"

namespace sdftrack {

struct PlaneOptions {
  double tolerance_m = 0.01;
  int start_x = -1, start_y = -1;  // a pixel on the plane; -1: search
  std::vector<Rect> leave_out;     // regions whose readings do not vote (tracked objects)
};

// Robust: the best of many local patches, then a reweighted total least squares fit to all readings within
// the tolerance. The normal points to the camera. Nothing when no plane holds a tenth of the readings.
std::optional<Plane> find_plane(const DepthFrame& frame, const Camera& camera, const PlaneOptions& options);

// Half the thickness of a plane in readings at a depth: noise of a depth sensor grows with the square.
inline double plane_tolerance_m(double tolerance_m, double depth_m) {
  return tolerance_m * std::max(1.0, depth_m * depth_m);
}

// The plane that most of some points lie on, if it holds `least_share` of them and is `extent_m` wide:
// the best of `seeds` triples that lie apart, refitted. Tolerance at 1 m.
std::optional<Plane> plane_among(const std::vector<Vec3d>& points, double tolerance_m, int seeds,
                                 double least_share, double extent_m);

// The plane from frame to frame: followed where it still holds, searched for anew now and then where not.
class PlaneFollower {
 public:
  void update(const DepthFrame& frame, const Camera& camera, const std::vector<Rect>& objects);
  const Plane* plane() const { return plane_ ? &*plane_ : nullptr; }

 private:
  std::optional<Plane> plane_;
  int frames_to_search_ = 0;
};

}  // namespace sdftrack
