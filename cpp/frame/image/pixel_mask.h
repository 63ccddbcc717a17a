// SPDX-License-Identifier: MIT
// A set of pixels of an image or of a window of it: growing, shrinking, connected pieces, filling.
#pragma once

#include <cstddef>
#include <vector>

#include "base/views.h"

namespace sdftrack::frame {

struct PixelMask {
  int width = 0, height = 0;
  std::vector<unsigned char> on;  // row by row, 0 or 1

  PixelMask() = default;
  PixelMask(int width_, int height_) : width(width_), height(height_), on(std::size_t(width_) * height_) {}
  std::size_t at(int x, int y) const { return std::size_t(y) * width + x; }
  bool operator()(int x, int y) const { return on[at(x, y)] != 0; }
  bool operator==(const PixelMask&) const = default;
};

int count(const PixelMask& mask);
void add(const PixelMask& more, PixelMask* mask);

// Pixels within `by` rows and columns of the mask; those with only mask within `by` (what lies outside the
// image counts as mask); and the first after the other, which fills gaps of 2 `by` pixels.
PixelMask dilated(const PixelMask& mask, int by);
PixelMask eroded(const PixelMask& mask, int by);
PixelMask closed(const PixelMask& mask, int by);

enum class Neighborhood { kSides, kSidesAndCorners };

// Connected pieces of a mask, numbered from 1 in the order of their first pixels.
struct Pieces {
  std::vector<int> number;       // of each pixel's piece; 0: not in the mask
  std::vector<int> areas = {0};  // pixels of each piece, by its number

  PixelMask piece(int k, const PixelMask& mask) const;
};
Pieces pieces_of(const PixelMask& mask, Neighborhood neighborhood);

struct Pixel {
  int x, y;
};

// Pixels of `free` connected to the seed without a step in depth between neighbours larger than `step_m`.
// Empty if the seed is not free. depth_m: of the size of `free`.
PixelMask joined(const ImageView<float>& depth_m, const PixelMask& free, Pixel seed, float step_m,
                 Neighborhood neighborhood);

}  // namespace sdftrack::frame
