// SPDX-License-Identifier: MIT
// Masks, and the pixels around each of theirs.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace sdftrack::calibration {

struct Mask {
  int width, height;
  std::vector<std::uint8_t> values;  // 0 or 1, row by row

  std::size_t index(int x, int y) const {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x);
  }
};

// Without what a square of 3 x 3 pixels does not fit into.
Mask opened(const Mask& mask);
// With what no square of 3 x 3 pixels beside it fits into.
Mask closed(const Mask& mask);
// Without what is `reach` pixels or nearer to a pixel of 0 or to the outside of the image, along x, y or
// both.
Mask eroded(const Mask& mask, int reach);

}  // namespace sdftrack::calibration
