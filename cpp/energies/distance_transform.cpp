// SPDX-License-Identifier: MIT
#include "energies/distance_transform.h"

#include <algorithm>
#include <cmath>

#include "base/to_int.h"

namespace sdftrack::energies {

namespace {

// Squared distance along each column to the nearest node that is not free, `far` beyond the reach.
void look_along_columns(const std::vector<unsigned char>& free, int w, int h, int reach, float far,
                        float* d) {
  for (int x = 0; x < w; ++x) {
    int gap = reach + 1;
    for (int y = 0; y < h; ++y) {
      const int at = y * w + x;
      gap = free[at] ? std::min(gap + 1, reach + 1) : 0;
      d[at] = float(gap);
    }
    gap = reach + 1;
    for (int y = h - 1; y >= 0; --y) {
      const int at = y * w + x;
      gap = d[at] > 0 ? std::min(gap + 1, int(d[at])) : 0;
      d[at] = gap > reach ? far : float(gap * gap);
    }
  }
}

}  // namespace

void distance_transform(const std::vector<unsigned char>& free, DistanceScratch* scratch,
                        DistanceGrid* grid) {
  const int w = grid->width, h = grid->height;
  const auto step = float(grid->step);
  // A reach beyond the grid's size adds nothing, and its square could exceed an int.
  const int reach = to_int(std::min(std::ceil(grid->limit_px / step), float(std::max(w, h))));
  const float far = grid->limit_px / step * (grid->limit_px / step);
  grid->distance_px.resize(free.size()), scratch->squared.resize(free.size());
  scratch->row.assign(w + 2 * reach, far);  // beyond the border: far
  look_along_columns(free, w, h, reach, far, scratch->squared.data());
  float* const row = scratch->row.data() + reach;
  for (int y = 0; y < h; ++y) {
    std::copy_n(scratch->squared.data() + y * w, w, row);
    float* const out = grid->distance_px.data() + y * w;
    std::fill_n(out, w, far);
    for (int dx = -reach; dx <= reach; ++dx)
      for (int x = 0; x < w; ++x) out[x] = std::min(out[x], row[x + dx] + float(dx * dx));
    for (int x = 0; x < w; ++x) out[x] = std::min(grid->limit_px, step * std::sqrt(out[x]));
  }
}

}  // namespace sdftrack::energies
