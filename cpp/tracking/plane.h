// SPDX-License-Identifier: MIT
// The dominant plane of a depth image: a table or a floor (thesis, section 3.8.3).
#pragma once

#include <optional>

#include "tracking/region.h"

namespace sdftrack {

struct PlaneOptions {
  double tolerance_m = 0.01;
  int start_x = -1, start_y = -1;  // a pixel on the plane; -1: search
};

// Robust: the best of many local patches, then a reweighted total least squares fit to all readings within
// the tolerance. The normal points to the camera. Nothing when no plane holds a tenth of the readings.
std::optional<Plane> find_plane(const DepthFrame& frame, const Camera& camera, const PlaneOptions& options);

// The plane of this frame, from that of the last one where it still holds; else searched for.
std::optional<Plane> follow_plane(const DepthFrame& frame, const Camera& camera,
                                  const std::optional<Plane>& last);

}  // namespace sdftrack
