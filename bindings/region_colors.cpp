// SPDX-License-Identifier: MIT
#include "region_colors.h"

#include "appearance/color_map.h"

namespace sdftrack::bindings {

void fetch_colors(const frame::DepthFrame& frame, const frame::Rect& rect, std::vector<std::uint8_t>* rgb) {
  const appearance::ColorImage& image = *frame.color;
  rgb->clear();
  for (int y = rect.y0; y < rect.y1; ++y)
    for (int x = rect.x0; x < rect.x1; ++x) {
      const float z = frame.depth_m(x, y);
      int cx = 0, cy = 0;
      float depth = 0;
      const Vec2f u{static_cast<float>(x), static_cast<float>(y)};
      const bool found = z > 0 && image.map.find(u, z, &cx, &cy, &depth);
      const unsigned char none[3] = {}, *const c = found ? image.at(cx, cy) : none;
      rgb->insert(rgb->end(), c, c + 3);
      if (found && !(c[0] | c[1] | c[2])) rgb->back() = 1;  // black is also a colour
    }
}

}  // namespace sdftrack::bindings
