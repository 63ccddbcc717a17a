// SPDX-License-Identifier: MIT
// Masks and morphological operations.
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

// Removes parts into which a square of 3 x 3 pixels does not fit.
Mask opened(const Mask& mask);
// Fills gaps into which a square of 3 x 3 pixels does not fit.
Mask closed(const Mask& mask);
// Removes pixels within `reach` pixels of a 0 or of the outside of the image, along x, y or both.
Mask eroded(const Mask& mask, int reach);

}  // namespace sdftrack::calibration
