// SPDX-License-Identifier: MIT
// The median of 5 x 5 pixels.
#pragma once

#include <vector>

#include "base/views.h"

namespace sdftrack::calibration {

// The median for every pixel of an image; border pixels are repeated outside.
std::vector<float> median5(const ImageView<float>& image);

}  // namespace sdftrack::calibration
