// SPDX-License-Identifier: MIT
// Candidate regions of the object that a click is on.
#pragma once

#include "tracking/start/connected_region.h"

namespace sdftrack::tracking {

// Regions of the image that hang together around px with a normal and with a strict threshold on the step in
// depth, and by colour if the frame has colours; without the planes around it that are larger than the
// object. At least one, most likely first. size_m: the largest distance between two points of the object.
// Throws std::invalid_argument without a measurement near px, on such a plane, or without a connected region.
std::vector<frame::PixelMask> click_regions(const frame::DepthFrame& frame, const Camera& camera, Vec2d px,
                                            double size_m);

}  // namespace sdftrack::tracking
