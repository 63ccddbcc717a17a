// SPDX-License-Identifier: MIT
// The colours inside and around an object's silhouette, at a pose or in a mask: measurements of depth are not
// needed.
#pragma once

#include <vector>

#include "appearance/color_model.h"
#include "frame/region.h"

namespace sdftrack::tracking {

// The object's are those of pixels whose rays meet the shape, weighed by what is known so far; the
// background's those of rays that pass it by three pixels and more, as far as `around_px`. What hides the
// object is left out where depth shows it, and else taken for it. Visits about `budget` pixels, evenly. The
// frame needs colours.
void count_silhouette_colors(const frame::DepthFrame& frame, const Camera& camera, const frame::Shape& shape,
                             const Rigidd& T_cam_obj, double around_px, int budget,
                             const appearance::ColorModel& known, appearance::ColorCounts* counts);

// The same inside and around a mask of the depth image (0: not the object); where nothing is measured, the
// object's distance is z_m.
void count_mask_and_ring_colors(const frame::DepthFrame& frame, const Camera& camera,
                                const std::vector<unsigned char>& mask, double z_m, double around_px,
                                int budget, appearance::ColorCounts* counts);

}  // namespace sdftrack::tracking
