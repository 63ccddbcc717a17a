// SPDX-License-Identifier: MIT
// The median of 5 x 5 pixels.
#pragma once

#include <vector>

#include "base/views.h"

namespace sdftrack::calibration {

// Of every pixel of an image; beyond its edge it goes on as it is there.
std::vector<float> median5(const ImageView<float>& image);

}  // namespace sdftrack::calibration
