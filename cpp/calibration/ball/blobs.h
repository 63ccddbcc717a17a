// SPDX-License-Identifier: MIT
// Connected regions of a mask.
#pragma once

#include <vector>

#include "base/vec.h"
#include "frame/image/pixel_mask.h"

namespace sdftrack::calibration {

struct Blob {
  int area = 0;
  std::vector<Vec2d> border;  // px, of the outline, without holes
};

// The `most` largest of at least min_area pixels, the largest first. Pixels are also connected over corners.
std::vector<Blob> largest_blobs(const frame::PixelMask& mask, std::size_t most, double min_area);

}  // namespace sdftrack::calibration
