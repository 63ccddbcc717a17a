// SPDX-License-Identifier: MIT
// Tells an object from what touches it in depth, by colour.
#pragma once

#include <optional>

#include "tracking/start/connected_region.h"

namespace sdftrack::tracking {

// The pixels of `free` whose colours are rather those of `region` than of what is around it, where both are
// learned from this frame. All masks are of a window whose first pixel is (x0, y0). Starts from `region`: two
// histograms of its pixels and of the others say which colours are its own, and each pixel goes by the mean
// of its neighbourhood; this is repeated with the new region. `sure` stays in it. nullopt: no colours, or
// none that tell the two apart.
std::optional<frame::PixelMask> cut_by_color(const frame::DepthFrame& frame, const Camera& camera, int x0,
                                             int y0, const frame::PixelMask& free,
                                             const frame::PixelMask& region, const frame::PixelMask& sure);

}  // namespace sdftrack::tracking
