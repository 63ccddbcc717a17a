// SPDX-License-Identifier: MIT
// Contours found so far, by the position of the eye.
#pragma once

#include <cstdint>
#include <vector>

#include "tracking/fit/contour_points.h"

namespace sdftrack::tracking {

// Contours by the rounded position of the eye: to two degrees of direction and 15 % of distance. On a round
// surface the contour's point slides as the eye moves, which moves the outline of a fixed point by only
// radius (angle)^2 / 2, less than 2e-4 of the radius. The roundings, and so the results, do not depend on
// what has been seen before.
class ContourLibrary {
 public:
  // Valid until the next call.
  const std::vector<ContourPoint>& seen_from(Vec3d eye_obj, const frame::Shape& shape, double focal_px,
                                             int requested, double thickness_px);

 private:
  struct Entry {
    std::uint64_t shape = 0;
    int cell = -1, distance = 0, requested = 0;
    double focal_px = 0, thickness_px = 0;
    std::vector<ContourPoint> points;
  };
  std::vector<Entry> entries_;
  std::size_t next_ = 0;  // the entry to replace next
  ContourScratch scratch_;
};

}  // namespace sdftrack::tracking
