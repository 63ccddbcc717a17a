// SPDX-License-Identifier: MIT
#include "calibration/ball/morphology.h"

#include <algorithm>

namespace sdftrack::calibration {

namespace {

std::uint8_t least(std::uint8_t a, std::uint8_t b) { return std::min(a, b); }
std::uint8_t most(std::uint8_t a, std::uint8_t b) { return std::max(a, b); }

// Applies `pick` to each pixel and its neighbours along x or y within the image.
template <class Pick>
Mask picked(const Mask& mask, int dx, int dy, const Pick& pick) {
  Mask out = mask;
  for (int y = 0; y < mask.height; ++y)
    for (int x = 0; x < mask.width; ++x)
      for (const int way : {-1, 1}) {
        const int u = x + way * dx, v = y + way * dy;
        if (u < 0 || v < 0 || u >= mask.width || v >= mask.height) continue;
        std::uint8_t& here = out.values[mask.index(x, y)];
        here = pick(here, mask.values[mask.index(u, v)]);
      }
  return out;
}

template <class Pick>
Mask squares(const Mask& mask, const Pick& pick) {
  return picked(picked(mask, 1, 0, pick), 0, 1, pick);
}

}  // namespace

Mask opened(const Mask& mask) { return squares(squares(mask, least), most); }

Mask closed(const Mask& mask) { return squares(squares(mask, most), least); }

Mask eroded(const Mask& mask, int reach) {
  Mask out = mask;
  for (int k = 0; k < reach; ++k) out = squares(out, least);
  for (int y = 0; y < mask.height; ++y)
    for (int x = 0; x < mask.width; ++x)
      if (x < reach || y < reach || x >= mask.width - reach || y >= mask.height - reach)
        out.values[mask.index(x, y)] = 0;
  return out;
}

}  // namespace sdftrack::calibration
