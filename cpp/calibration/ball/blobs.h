// SPDX-License-Identifier: MIT
// Connected regions of a mask.
#pragma once

#include <cstdint>
#include <vector>

#include "base/vec.h"

namespace sdftrack::calibration {

struct Mask {
  int width, height;
  std::vector<std::uint8_t> values;  // 0 or 1, row by row
};

struct Blob {
  int area = 0;
  std::vector<Vec2d> border;  // px, of its outline; those of its holes are left out
};

// The `most` largest of at least min_area pixels, the largest first. Pixels touch at corners, too.
std::vector<Blob> largest_blobs(const Mask& mask, std::size_t most, double min_area);
// Without what a square of 3 x 3 pixels does not fit into.
Mask opened(const Mask& mask);

}  // namespace sdftrack::calibration
