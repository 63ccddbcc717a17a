// SPDX-License-Identifier: MIT
// Contours that have been found, by where the eye stands.
#pragma once

#include <cstdint>
#include <vector>

#include "tracking/fit/contour_points.h"

namespace sdftrack::tracking {

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
    std::uint64_t shape = 0;
    int cell = -1, distance = 0, wanted = 0;
    double focal_px = 0, thickness_px = 0;
    std::vector<ContourPoint> points;
  };
  std::vector<Entry> entries_;
  std::size_t next_ = 0;  // to be replaced
  ContourScratch scratch_;
};

}  // namespace sdftrack::tracking
