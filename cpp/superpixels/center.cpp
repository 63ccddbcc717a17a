// SPDX-License-Identifier: MIT
#include "superpixels/center.h"

#include <algorithm>
#include <cmath>

#include "base/to_int.h"

namespace sdftrack::superpixels {

namespace {

constexpr double kFinest = 32;  // parts of a unit of L*a*b*: 8 * 108 * 32 fits into 16 bits
// Limit for m * scale: a centre is at most 2.6 S from the middle of a pixel's cell along an axis, and 8 times
// that must fit into 16 bits; the squared distance, (259^2 + 2 * (3.1 m)^2) scale^2, into 27.
constexpr double kMaxReach = 1500;

std::vector<int> borders(int length, int parts) {
  std::vector<int> begin(std::size_t(parts) + 1);
  for (int i = 0; i <= parts; ++i) begin[i] = int(static_cast<std::int64_t>(length) * i / parts);
  return begin;
}

std::vector<int> middles(const std::vector<int>& begin, double unit) {
  std::vector<int> places;
  for (std::size_t i = 0; i + 1 < begin.size(); ++i)
    places.push_back(place_of((begin[i] + begin[i + 1] - 1) / 2, unit));
  return places;
}

}  // namespace

CellGrid make_grid(int width, int height, std::int64_t pixels, int n_segments, double compactness) {
  CellGrid g;
  g.width = width, g.height = height;
  const double all = double(width) * height;
  // With a mask the cells are as small as for a division of the whole image.
  const double requested = std::min(all, double(n_segments) * all / double(pixels));
  const double step = std::sqrt(all / requested);
  // The shorter side first: rounding changes its few cells the most.
  const auto cells = [](double wanted_cells, int length) {
    return to_int(std::clamp(std::round(wanted_cells), 1., double(length)));
  };
  if (height <= width)
    g.ny = cells(height / step, height), g.nx = cells(requested / g.ny, width);
  else
    g.nx = cells(width / step, width), g.ny = cells(requested / g.nx, height);
  g.side_px = std::max(double(width) / g.nx, double(height) / g.ny);
  while (compactness * g.scale > kMaxReach) g.scale /= 2;
  g.unit = compactness * g.scale / g.side_px;
  g.x_begin = borders(width, g.nx), g.y_begin = borders(height, g.ny);
  g.x_middle = middles(g.x_begin, g.unit), g.y_middle = middles(g.y_begin, g.unit);
  return g;
}

}  // namespace sdftrack::superpixels
