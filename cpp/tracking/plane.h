// SPDX-License-Identifier: MIT
// The dominant plane of a depth image: a table or a floor (thesis, section 3.8.3).
#pragma once

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
