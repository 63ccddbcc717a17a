// SPDX-License-Identifier: MIT
#include "calibration/ball/blobs.h"

#include <algorithm>
#include <utility>

namespace sdftrack::calibration {

namespace {

using Pixel = std::pair<int, int>;
constexpr int kAround[8][2] = {{1, 0}, {-1, 0}, {0, 1}, {0, -1}, {1, 1}, {1, -1}, {-1, 1}, {-1, -1}};

// Removes the pixels of 1 connected to a pixel from the mask and returns them. `ways`: 4 or 8 neighbours.
std::vector<Pixel> taken_out(Mask* mask, int x, int y, int ways) {
  std::vector<Pixel> found{{x, y}};
  mask->values[mask->index(x, y)] = 0;
  for (std::size_t next = 0; next < found.size(); ++next)
    for (int k = 0; k < ways; ++k) {
      const int u = found[next].first + kAround[k][0], v = found[next].second + kAround[k][1];
      if (u < 0 || v < 0 || u >= mask->width || v >= mask->height) continue;
      std::uint8_t& there = mask->values[mask->index(u, v)];
      if (!there) continue;
      there = 0;
      found.push_back({u, v});
    }
  return found;
}

// The pixels next to the outside, which is the 4-connected region around all pixels.
std::vector<Vec2d> border_of(const std::vector<Pixel>& pixels) {
  int x0 = pixels[0].first, x1 = x0, y0 = pixels[0].second, y1 = y0;
  for (const auto& [x, y] : pixels) {
    x0 = std::min(x0, x), x1 = std::max(x1, x);
    y0 = std::min(y0, y), y1 = std::max(y1, y);
  }
  Mask rest{x1 - x0 + 3, y1 - y0 + 3, {}};
  rest.values.assign(static_cast<std::size_t>(rest.width) * static_cast<std::size_t>(rest.height), 1);
  for (const auto& [x, y] : pixels) rest.values[rest.index(x - x0 + 1, y - y0 + 1)] = 0;
  Mask outside{rest.width, rest.height, std::vector<std::uint8_t>(rest.values.size(), 0)};
  for (const auto& [x, y] : taken_out(&rest, 0, 0, 4)) outside.values[outside.index(x, y)] = 1;
  std::vector<Vec2d> border;
  for (const auto& [x, y] : pixels) {
    const int u = x - x0 + 1, v = y - y0 + 1;
    if (std::any_of(kAround, kAround + 4,
                    [&](const int* d) { return outside.values[outside.index(u + d[0], v + d[1])] != 0; }))
      border.push_back({static_cast<double>(x), static_cast<double>(y)});
  }
  return border;
}

}  // namespace

std::vector<Blob> largest_blobs(const Mask& mask, std::size_t most, double min_area) {
  Mask rest = mask;
  std::vector<std::vector<Pixel>> found;
  for (int y = 0; y < mask.height; ++y)
    for (int x = 0; x < mask.width; ++x) {
      if (!rest.values[mask.index(x, y)]) continue;
      std::vector<Pixel> pixels = taken_out(&rest, x, y, 8);
      if (static_cast<double>(pixels.size()) >= min_area) found.push_back(std::move(pixels));
    }
  std::stable_sort(found.begin(), found.end(),
                   [](const auto& a, const auto& b) { return a.size() > b.size(); });
  if (found.size() > most) found.resize(most);
  std::vector<Blob> out;
  for (const std::vector<Pixel>& pixels : found)
    out.push_back({static_cast<int>(pixels.size()), border_of(pixels)});
  return out;
}

}  // namespace sdftrack::calibration
