// SPDX-License-Identifier: MIT
// The colours inside and around an object's silhouette, at a pose or in a mask; no depth is needed.
#pragma once

#include <vector>

#include "appearance/color_model.h"
#include "frame/region.h"

namespace sdftrack::tracking {

// The object's colours are those of pixels whose rays meet the shape, weighted by what is known so far. The
// background's are those of rays that pass it by three pixels or more, up to `around_px`. An occluder is left
// out where depth shows it, otherwise it counts as the object. Visits about `budget` pixels, evenly. The
// frame needs colours.
void count_silhouette_colors(const frame::DepthFrame& frame, const Camera& camera, const frame::Shape& shape,
                             const Rigidd& T_cam_obj, double around_px, int budget,
                             const appearance::ColorModel& known, appearance::ColorCounts* counts);

// The same inside and around a mask of the depth image (0: not the object); where depth is missing, the
// object's distance is z_m.
void count_mask_and_ring_colors(const frame::DepthFrame& frame, const Camera& camera,
                                const std::vector<unsigned char>& mask, double z_m, double around_px,
                                int budget, appearance::ColorCounts* counts);

}  // namespace sdftrack::tracking
