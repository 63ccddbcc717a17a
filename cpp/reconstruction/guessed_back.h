// SPDX-License-Identifier: MIT
// How far back a body reaches that one frame shows from the front (docs/math/reconstruction.md, section 5).
#pragma once

#include <vector>

#include "base/camera.h"
#include "base/views.h"
#include "frame/image/pixel_mask.h"

namespace sdftrack::reconstruction {

// Depth (m) of the far side at each pixel: the near side mirrored at the depth of the outline, and at least
// as thick as the mask is narrow. 0 outside the mask and where nothing can be guessed. Rays are those of the
// camera without its distortion.
std::vector<float> guessed_back(const ImageView<float>& depth_m, const frame::PixelMask& on_object,
                                const Camera& camera);

}  // namespace sdftrack::reconstruction
