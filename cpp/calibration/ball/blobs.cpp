// SPDX-License-Identifier: MIT
#include "calibration/ball/blobs.h"

#include <algorithm>
#include <utility>

namespace sdftrack::calibration {

namespace {

using Pixel = std::pair<int, int>;
constexpr int kAround[8][2] = {{1, 0}, {-1, 0}, {0, 1}, {0, -1}, {1, 1}, {1, -1}, {-1, 1}, {-1, -1}};

// Removes the pixels of 1 connected to a pixel from the mask and returns them. `ways`: 4 or 8 neighbours.
std::vector<Pixel> taken_out(frame::PixelMask* mask, int x, int y, int ways) {
  std::vector<Pixel> found{{x, y}};
  mask->on[mask->at(x, y)] = 0;
  for (std::size_t next = 0; next < found.size(); ++next)
    for (int k = 0; k < ways; ++k) {
      const int u = found[next].first + kAround[k][0], v = found[next].second + kAround[k][1];
      if (u < 0 || v < 0 || u >= mask->width || v >= mask->height) continue;
      unsigned char& there = mask->on[mask->at(u, v)];
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
  frame::PixelMask rest(x1 - x0 + 3, y1 - y0 + 3), outside = rest;
  rest.on.assign(rest.on.size(), 1);
  for (const auto& [x, y] : pixels) rest.on[rest.at(x - x0 + 1, y - y0 + 1)] = 0;
  for (const auto& [x, y] : taken_out(&rest, 0, 0, 4)) outside.on[outside.at(x, y)] = 1;
  std::vector<Vec2d> border;
  for (const auto& [x, y] : pixels) {
    const int u = x - x0 + 1, v = y - y0 + 1;
    if (std::any_of(kAround, kAround + 4, [&](const int* d) { return outside(u + d[0], v + d[1]); }))
      border.push_back({double(x), double(y)});
  }
  return border;
}

}  // namespace

std::vector<Blob> largest_blobs(const frame::PixelMask& mask, std::size_t most, double min_area) {
  frame::PixelMask rest = mask;
  std::vector<std::vector<Pixel>> found;
  for (int y = 0; y < mask.height; ++y)
    for (int x = 0; x < mask.width; ++x) {
      if (!rest(x, y)) continue;
      std::vector<Pixel> pixels = taken_out(&rest, x, y, 8);
      if (double(pixels.size()) >= min_area) found.push_back(std::move(pixels));
    }
  std::stable_sort(found.begin(), found.end(),
                   [](const auto& a, const auto& b) { return a.size() > b.size(); });
  if (found.size() > most) found.resize(most);
  std::vector<Blob> out;
  for (const std::vector<Pixel>& pixels : found) out.push_back({int(pixels.size()), border_of(pixels)});
  return out;
}

}  // namespace sdftrack::calibration
