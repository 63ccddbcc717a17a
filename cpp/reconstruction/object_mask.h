// SPDX-License-Identifier: MIT
// The pixels of an object in a box of a depth image, and the size of such pixels.
#pragma once

#include "base/views.h"
#include "frame/image/pixel_mask.h"
#include "frame/region.h"

namespace sdftrack::reconstruction {

using frame::PixelMask;

// Measurements in a box connected to its centre, with the largest depth step that does not lead out of the
// box. Throws std::invalid_argument without measurements there.
PixelMask mask_of_box(const ImageView<float>& depth_m, const frame::Rect& box);

// The shorter side, in pixels, of the narrowest rectangle around the pixels (of least area).
double shorter_side_px(const PixelMask& mask);

}  // namespace sdftrack::reconstruction
