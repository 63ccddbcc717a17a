// SPDX-License-Identifier: MIT
// The grid of the initial centres, a centre and the sums for its mean: whole numbers, so that the order of
// additions does not matter.
#pragma once

#include <cstdint>
#include <vector>

#include "base/hd.h"

namespace sdftrack::superpixels {

// The largest whole number that is not above x, |x| < 2^31: floor() without a call.
HD int whole_below(double x) {
  const int whole = int(x);
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

// Colour times CellGrid::scale, place in units of CellGrid::unit. `used`: its cell has a pixel inside the
// mask. `beneath`: the colour of the pixel at its place, for the next image of a video.
struct Center {
  int color[3] = {0, 0, 0};
  int x = 0, y = 0, z = 0;
  int used = 0;
  int beneath[3] = {0, 0, 0};
};

// Sums over the pixels of a centre; x and y in pixels.
struct CenterSums {
  std::int64_t color[3] = {0, 0, 0}, count = 0, x = 0, y = 0, z = 0, none = 0;  // eight: RowOps::settle

  HD void add(const CenterSums& other) {
    count += other.count, x += other.x, y += other.y, z += other.z;
    for (int i = 0; i < 3; ++i) color[i] += other.color[i];
  }
};

// a / n to the nearest, halves upwards; 0 < n < 2^31 and |a| < 2^46. The rounding error of the quotient of
// two doubles is smaller than the distance of such a ratio to a whole number, unless it is one.
HD int rounded_ratio(std::int64_t a, std::int64_t n) {
  return whole_below(double(2 * a + n) / double(2 * n));
}

// Without a branch, because the larger one cannot be predicted.
HD std::int64_t apart(int a, int b) {
  const std::int64_t way = static_cast<std::int64_t>(a) - b;
  return way < 0 ? -way : way;
}

// Moves a centre to its mean; one without pixels stays. Returns the distance (Table A.1's residual, in units
// of colour times the scale).
HD std::int64_t move_center(const CenterSums& sums, double unit, Center* center) {
  if (sums.count == 0) return 0;
  const double n = double(sums.count);
  Center next = *center;
  for (int i = 0; i < 3; ++i) next.color[i] = rounded_ratio(sums.color[i], sums.count);
  next.x = place_of(double(sums.x) / n, unit);
  next.y = place_of(double(sums.y) / n, unit);
  next.z = rounded_ratio(sums.z, sums.count);
  std::int64_t moved = 0;
  for (int i = 0; i < 3; ++i) moved += apart(next.color[i], center->color[i]);
  moved += apart(next.x, center->x) + apart(next.y, center->y) + apart(next.z, center->z);
  *center = next;
  return moved;
}

}  // namespace sdftrack::superpixels
