// SPDX-License-Identifier: MIT
#include "contour/color_difference.h"

#include <cmath>
#include <vector>

namespace sdftrack::contour {

ColorDifference color_difference(const RgbView& image, const ImagePart& inner, const ImagePart& outer) {
  constexpr std::size_t kBins = 16 * 16 * 16;
  constexpr double kPi = 3.14159265358979323846;
  std::vector<double> count[2] = {std::vector<double>(kBins), std::vector<double>(kBins)};
  double all[2] = {0, 0};
  for (int y = outer.y0; y < outer.y1; ++y)
    for (int x = outer.x0; x < outer.x1; ++x) {
      const unsigned char* rgb = image.rgb + 3 * (static_cast<std::ptrdiff_t>(y) * image.width + x);
      const bool within = x >= inner.x0 && x < inner.x1 && y >= inner.y0 && y < inner.y1;
      const auto bin = static_cast<std::size_t>(((rgb[0] >> 4) * 16 + (rgb[1] >> 4)) * 16 + (rgb[2] >> 4));
      ++count[within][bin], ++all[within];
    }
  // The difference of two shares of n and m draws has the variance p (1/n + 1/m); its mean magnitude is
  // sqrt(2/pi) times the sd.
  const double spread = 1 / all[0] + 1 / all[1];
  ColorDifference out{0, 0};
  for (std::size_t bin = 0; bin < kBins; ++bin) {
    const double share = (count[0][bin] + count[1][bin]) / (all[0] + all[1]);
    out.distance += 0.5 * std::abs(count[0][bin] / all[0] - count[1][bin] / all[1]);
    out.by_chance += 0.5 * std::sqrt(2 / kPi * share * spread);
  }
  return out;
}

}  // namespace sdftrack::contour
