// SPDX-License-Identifier: MIT
// The grid of the initial centres, and the units in which all quantities are whole numbers.
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "base/hd.h"

namespace sdftrack::superpixels {

// The largest whole number that is not above x, |x| < 2^31: floor() without a call.
HD int whole_below(double x) {
  const int whole = static_cast<int>(x);
  return whole - (x < whole);
}

// Place of the pixel or the mean of pixels at `px`, in 1 / unit pixels. Rounded once.
HD int place_of(double px, double unit) { return whole_below(px * unit + 0.5); }

// nx x ny cells of nearly equal size, with one centre each. A pixel may belong to the centres of the 3 x 3
// cells around its own. Colours are counted in 1 / scale of a unit of L*a*b*, places in 1 / unit pixels: then
// the squared distance is a plain sum of squares, (d_lab^2 + (m d_xy / S)^2) scale^2, and fits into 28 bits.
struct CellGrid {
  int width = 0, height = 0, nx = 0, ny = 0;
  double side_px = 1;  // S of Eq. A.1
  double scale = 32, unit = 1;
  std::vector<int> x_begin, y_begin;    // of cells, pixels; one more than there are cells
  std::vector<int> x_middle, y_middle;  // place_of the middles of cells

  int cells() const { return nx * ny; }
};

// `pixels`: the number of pixels to divide (fewer than width x height with a mask).
CellGrid make_grid(int width, int height, std::int64_t pixels, int n_segments, double compactness);

// The largest compactness; from here on colours have no influence.
constexpr double kMaxCompact = 4000;

}  // namespace sdftrack::superpixels
