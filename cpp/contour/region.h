// SPDX-License-Identifier: MIT
// The part of an image that an object's grid covers.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "base/to_int.h"
#include "contour/grid_warp.h"

namespace sdftrack::contour {

struct RgbView {
  const unsigned char* rgb;
  int width, height;
};

// Pixels x0 <= x < x1, y0 <= y < y1.
struct ImagePart {
  int x0, y0, x1, y1;
  int width() const { return std::max(0, x1 - x0); }
  int height() const { return std::max(0, y1 - y0); }
  bool empty() const { return width() == 0 || height() == 0; }
};

// Cells x0 <= x <= x1, y0 <= y <= y1.
struct CellBox {
  int x0, y0, x1, y1;
  CellBox grown(int by, int nx, int ny) const {
    return {std::max(0, x0 - by), std::max(0, y0 - by), std::min(nx - 1, x1 + by), std::min(ny - 1, y1 + by)};
  }
  bool lies_on(int nx, int ny) const { return x0 >= 0 && y0 >= 0 && x1 < nx && y1 < ny; }

  template <class Archive, class Self>
  static void visit(Archive& archive, Self& self) {
    auto& [left, top, right, bottom] = self;
    archive(left, top, right, bottom);
  }
};

// The cells, with phi in cells, negative inside, and their place in the image.
struct ContourGrid {
  int nx = 0, ny = 0;
  GridWarp warp;
  std::vector<float> phi;
  CellBox inside{0, 0, 0, 0};  // holds all cells with phi < 0

  CellBox all() const { return {0, 0, nx - 1, ny - 1}; }
  double mid_x() const { return 0.5 * (nx - 1); }
  double mid_y() const { return 0.5 * (ny - 1); }
  // 3 x 3: cells, counted from the corner of the grid, to pixels.
  std::array<double, 9> to_image() const {
    const GridWarp& w = warp;
    return {w.a[0], w.a[1], w.t[0] - w.a[0] * mid_x() - w.a[1] * mid_y(),
            w.a[2], w.a[3], w.t[1] - w.a[2] * mid_x() - w.a[3] * mid_y(),
            0,      0,      1};
  }
  bool holds(const std::vector<float>& cells) const {
    return cells.size() == std::size_t(nx) * ny &&
           std::all_of(cells.begin(), cells.end(), [](float v) { return std::isfinite(v); });
  }

  template <class Archive, class Self>
  static void visit(Archive& archive, Self& self) {
    auto& [columns, rows, lies, cells, box] = self;
    archive(columns, rows, lies, cells, box);
    archive.check(columns >= 0 && rows >= 0 && self.holds(cells) &&
                  (cells.empty() || box.lies_on(columns, rows)));
  }
};

// The pixels of the image that may lie on these cells.
inline ImagePart rect_of(const ContourGrid& grid, const CellBox& cells, const RgbView& image) {
  const double mx = 0.5 * (cells.x1 - cells.x0), my = 0.5 * (cells.y1 - cells.y0);
  double u, v;
  grid.warp.to_image(0.5 * (cells.x0 + cells.x1) - grid.mid_x(), 0.5 * (cells.y0 + cells.y1) - grid.mid_y(),
                     &u, &v);
  const double* const a = grid.warp.a;
  const double dx = std::abs(a[0]) * mx + std::abs(a[1]) * my, dy = std::abs(a[2]) * mx + std::abs(a[3]) * my;
  const auto pixel = [](double x, int most) { return to_int(std::clamp(x, 0.0, double(most))); };
  return {pixel(std::floor(u - dx), image.width), pixel(std::floor(v - dy), image.height),
          pixel(std::ceil(u + dx) + 1, image.width), pixel(std::ceil(v + dy) + 1, image.height)};
}

// Calls body(y, xa, xb, gx, gy, step_x, step_y) for each row of the rectangle: its pixels xa <= x < xb lie on
// the cells, the first one at cell (gx, gy) and each next one a step farther.
template <class Body>
void each_row_on(const ContourGrid& grid, const CellBox& cells, const ImagePart& rect, const Body& body) {
  const GridWarp to_grid = grid.warp.inverse();
  const double least[2] = {double(cells.x0), double(cells.y0)};
  const double most[2] = {cells.x1 - 0.001, cells.y1 - 0.001};
  for (int y = rect.y0; y < rect.y1; ++y) {
    double low = rect.x0, high = rect.x1 - 1;
    double first[2];
    for (int k = 0; k < 2; ++k) {
      const double step = to_grid.a[2 * k];
      first[k] = to_grid.a[2 * k + 1] * y + to_grid.t[k] + (k == 0 ? grid.mid_x() : grid.mid_y());
      if (std::abs(step) < 1e-9) {
        if (first[k] < least[k] || first[k] > most[k]) high = low - 1;
        continue;
      }
      const double p = (least[k] - first[k]) / step, q = (most[k] - first[k]) / step;
      low = std::max(low, std::min(p, q)), high = std::min(high, std::max(p, q));
    }
    // Checked before rounding: a row outside the cells with a step near zero meets them at about 1e10.
    if (!(low <= high)) continue;
    const int xa = to_int(std::ceil(low)), xb = to_int(std::floor(high)) + 1;
    if (xa >= xb) continue;
    body(y, xa, xb, first[0] + to_grid.a[0] * xa, first[1] + to_grid.a[2] * xa, to_grid.a[0], to_grid.a[2]);
  }
}

}  // namespace sdftrack::contour
