// SPDX-License-Identifier: MIT
// Candidate regions of an object whose place is unknown: what stands out from the planes of a frame.
#pragma once

#include "tracking/start/connected_region.h"

namespace sdftrack::tracking {

struct StandingRegions {
  std::vector<frame::PixelMask> regions;  // of about the object's size, likeliest sizes first
  std::vector<Pixel> pixels;              // of larger things, nearest first, which may contain the object
};

// At most `most` of each. Pieces that lie together, parted by holes of the sensor, are a region of their own
// as well. size_m: the largest extent of the object.
StandingRegions standing_regions(const frame::DepthFrame& frame, const Camera& camera, double size_m,
                                 int most = 12);

}  // namespace sdftrack::tracking
