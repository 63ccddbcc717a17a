// SPDX-License-Identifier: MIT
// The colours inside and around an object's silhouette at a pose: readings of depth are not needed.
#pragma once

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

}  // namespace sdftrack::tracking
