// SPDX-License-Identifier: MIT
#include "frame/image/pixel_mask.h"

#include <algorithm>
#include <cmath>

namespace sdftrack::frame {

namespace {

// The pixels of a line that have `value` within `by` of them along it.
void spread_line(const unsigned char* from, std::size_t stride, int n, int by, unsigned char value,
                 unsigned char* to) {
  int next = 0;  // pixels from here on are not written yet
  for (int i = 0; i < n; ++i) {
    if (from[std::size_t(i) * stride] != value) continue;
    for (int k = std::max(next, i - by); k <= std::min(n - 1, i + by); ++k)
      to[std::size_t(k) * stride] = value;
    next = std::min(n, i + by + 1);
  }
}

PixelMask spread(const PixelMask& mask, int by, unsigned char value) {
  PixelMask rows = mask;
  const auto w = std::size_t(mask.width);
  for (int y = 0; y < mask.height; ++y)
    spread_line(&mask.on[mask.at(0, y)], 1, mask.width, by, value, &rows.on[mask.at(0, y)]);
  PixelMask out = rows;
  for (int x = 0; x < mask.width; ++x)
    spread_line(&rows.on[mask.at(x, 0)], w, mask.height, by, value, &out.on[mask.at(x, 0)]);
  return out;
}

}  // namespace

int count(const PixelMask& mask) { return int(std::count(mask.on.begin(), mask.on.end(), 1)); }

void add(const PixelMask& more, PixelMask* mask) {
  for (std::size_t i = 0; i < mask->on.size(); ++i) mask->on[i] |= more.on[i];
}

PixelMask dilated(const PixelMask& mask, int by) { return spread(mask, by, 1); }
PixelMask eroded(const PixelMask& mask, int by) { return spread(mask, by, 0); }
PixelMask closed(const PixelMask& mask, int by) { return eroded(dilated(mask, by), by); }

PixelMask Pieces::piece(int k, const PixelMask& mask) const {
  PixelMask out(mask.width, mask.height);
  for (std::size_t i = 0; i < number.size(); ++i) out.on[i] = number[i] == k && mask.on[i];
  return out;
}

Pieces pieces_of(const PixelMask& mask, Neighborhood neighborhood) {
  Pieces out;
  out.number.assign(mask.on.size(), 0);
  const bool corners = neighborhood == Neighborhood::kSidesAndCorners;
  std::vector<std::size_t> left;  // pixels whose neighbours are not visited yet
  const auto w = std::size_t(mask.width);
  for (std::size_t first = 0; first < mask.on.size(); ++first) {
    if (!mask.on[first] || out.number[first]) continue;
    const auto number = int(out.areas.size());
    out.areas.push_back(0);
    left.assign(1, first);
    out.number[first] = number;
    while (!left.empty()) {
      const std::size_t i = left.back();
      left.pop_back();
      ++out.areas.back();
      const auto x = int(i % w), y = int(i / w);
      for (int v = std::max(0, y - 1); v <= std::min(mask.height - 1, y + 1); ++v)
        for (int u = std::max(0, x - 1); u <= std::min(mask.width - 1, x + 1); ++u) {
          const std::size_t j = mask.at(u, v);
          if (!mask.on[j] || out.number[j] || (!corners && u != x && v != y)) continue;
          out.number[j] = number;
          left.push_back(j);
        }
    }
  }
  return out;
}

PixelMask joined(const ImageView<float>& depth_m, const PixelMask& free, Pixel seed, float step_m,
                 Neighborhood neighborhood) {
  PixelMask out(free.width, free.height);
  if (!free(seed.x, seed.y)) return out;
  const bool corners = neighborhood == Neighborhood::kSidesAndCorners;
  std::vector<Pixel> left{seed};
  out.on[out.at(seed.x, seed.y)] = 1;
  while (!left.empty()) {
    const Pixel at = left.back();
    left.pop_back();
    const float z = depth_m(at.x, at.y);
    for (int y = std::max(0, at.y - 1); y <= std::min(free.height - 1, at.y + 1); ++y)
      for (int x = std::max(0, at.x - 1); x <= std::min(free.width - 1, at.x + 1); ++x) {
        const std::size_t i = out.at(x, y);
        if (out.on[i] || !free.on[i] || !(std::abs(depth_m(x, y) - z) <= step_m)) continue;
        if (!corners && x != at.x && y != at.y) continue;
        out.on[i] = 1;
        left.push_back({x, y});
      }
  }
  return out;
}

}  // namespace sdftrack::frame
