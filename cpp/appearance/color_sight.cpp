// SPDX-License-Identifier: MIT
#include "appearance/color_sight.h"

#include <algorithm>
#include <limits>

namespace sdftrack::appearance {

namespace {

// Relative depth: a smaller depth step shifts the two images by less than half a pixel against each other
// (25 mm apart, 525 px), and the slope of a surface within a cell hides nothing.
constexpr float kBehind = 1.025f;

}  // namespace

void ColorSight::clear(int x0, int y0, int x1, int y1, int cell_px) {
  x0_ = x0, y0_ = y0, cell_px_ = std::max(1, cell_px);
  columns_ = std::max(0, (x1 - x0 + cell_px_ - 1) / cell_px_);
  rows_ = std::max(0, (y1 - y0 + cell_px_ - 1) / cell_px_);
  nearest_.assign(std::size_t(columns_) * rows_, std::numeric_limits<float>::infinity());
}

int ColorSight::cell_of(int x, int y) const {
  if (x < x0_ || y < y0_) return -1;
  const int i = (x - x0_) / cell_px_, j = (y - y0_) / cell_px_;
  return i < columns_ && j < rows_ ? j * columns_ + i : -1;
}

void ColorSight::add(int x, int y, float depth) {
  const int cell = cell_of(x, y);
  if (cell < 0) return;
  float& nearest = nearest_[cell];
  nearest = std::min(nearest, depth);
}

bool ColorSight::sees(int x, int y, float depth) const {
  const int cell = cell_of(x, y);
  return cell < 0 || depth < kBehind * nearest_[cell];
}

}  // namespace sdftrack::appearance
