// SPDX-License-Identifier: MIT
#include "plane/pixel_mask.h"

#include <algorithm>

namespace sdftrack::plane {

namespace {

// Marks the pixels that have one with `value` within `by` along each axis.
PixelMask near_value(const PixelMask& mask, unsigned char value, int by) {
  const int w = mask.width, h = mask.height;
  PixelMask along_x(w, h), out(w, h);
  for (int y = 0; y < h; ++y)
    for (int x = 0, last = -by - 1; x < w + by; ++x) {
      if (x < w && mask.on[mask.index(x, y)] == value) last = x;
      if (x - by >= 0) along_x.on[mask.index(x - by, y)] = last >= x - 2 * by;
    }
  std::vector<int> last(static_cast<std::size_t>(w), -by - 1);
  for (int y = 0; y < h + by; ++y)
    for (int x = 0; x < w; ++x) {
      int& seen = last[static_cast<std::size_t>(x)];
      if (y < h && along_x(x, y)) seen = y;
      if (y - by >= 0) out.on[mask.index(x, y - by)] = seen >= y - 2 * by;
    }
  return out;
}

}  // namespace

std::size_t PixelMask::count() const {
  return static_cast<std::size_t>(
      std::count_if(on.begin(), on.end(), [](unsigned char v) { return v != 0; }));
}

PixelMask grown(const PixelMask& mask, int by) { return near_value(mask, 1, by); }

PixelMask shrunk(const PixelMask& mask, int by) {
  PixelMask out = near_value(mask, 0, by);
  for (unsigned char& v : out.on) v ^= 1;
  return out;
}

MaskPieces connected_pieces(const PixelMask& mask) {
  MaskPieces out;
  out.number.assign(mask.on.size(), 0);
  std::vector<int> open;
  for (std::size_t start = 0; start < mask.on.size(); ++start) {
    if (!mask.on[start] || out.number[start]) continue;
    const int number = static_cast<int>(out.area.size());
    out.area.push_back(0);
    open.assign(1, static_cast<int>(start)), out.number[start] = number;
    while (!open.empty()) {
      const int at = open.back(), x = at % mask.width, y = at / mask.width;
      open.pop_back(), ++out.area.back();
      for (int ny = std::max(0, y - 1); ny <= std::min(mask.height - 1, y + 1); ++ny)
        for (int nx = std::max(0, x - 1); nx <= std::min(mask.width - 1, x + 1); ++nx) {
          const std::size_t next = mask.index(nx, ny);
          if (!mask.on[next] || out.number[next]) continue;
          out.number[next] = number, open.push_back(static_cast<int>(next));
        }
    }
  }
  return out;
}

}  // namespace sdftrack::plane
