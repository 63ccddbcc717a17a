// SPDX-License-Identifier: MIT
// The first segmentation of a box, from the colours, the position in the box and the edges of the image
// (docs/math/contour.md, section 5).
#pragma once

#include "contour/memory/plane.h"
#include "contour/tracker.h"

namespace sdftrack::contour {

// Starts with a box according to options().box_prior. Throws std::invalid_argument, and changes nothing, if
// the colours in the box are the same as those around it.
ContourFrame start_in_box(ContourTracker* tracker, const RgbView& image, const ImagePart& box);

// 1 minus the mean IoU of the first mask, of the whole image, with the masks of slightly shifted boxes: a
// large value means that the box does not determine the mask.
double first_instability(const RgbView& image, const ImagePart& box, const Mask& first,
                         const ContourOptions& options);

// The guided filter (He, Sun and Tang, ECCV 2010): a local mean that does not cross the edges of `gray`.
Picture edge_aware_mean(const Picture& gray, const Picture& values, int radius_px);

}  // namespace sdftrack::contour
