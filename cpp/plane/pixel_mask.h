// SPDX-License-Identifier: MIT
// Sets of pixels of an image.
#pragma once

#include <cstddef>
#include <vector>

namespace sdftrack::plane {

struct PixelMask {
  int width = 0, height = 0;
  std::vector<unsigned char> on;  // 0 or 1, row by row

  PixelMask() = default;
  PixelMask(int width_, int height_, unsigned char value = 0)
      : width(width_),
        height(height_),
        on(static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_), value) {}

  std::size_t index(int x, int y) const {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x);
  }
  bool operator()(int x, int y) const { return on[index(x, y)] != 0; }
  std::size_t count() const;
};

// All pixels within `by` of the mask along each axis.
PixelMask grown(const PixelMask& mask, int by);
// The pixels whose neighbours within `by` along each axis are all in the mask, or outside the image.
PixelMask shrunk(const PixelMask& mask, int by);

// Pieces connected over sides and corners: each pixel's number from 1 on, 0 outside; areas by number.
struct MaskPieces {
  std::vector<int> number;
  std::vector<int> area = {0};
};
MaskPieces connected_pieces(const PixelMask& mask);

}  // namespace sdftrack::plane
