// SPDX-License-Identifier: MIT
// Tests whether the colours in a box differ from those around it by more than noise.
#pragma once

#include "contour/region_model.h"

namespace sdftrack::contour {

struct ColorDifference {
  double distance;   // total variation between the two histograms of 16^3 colours, 0 to 1
  double by_chance;  // expected distance if both histograms are draws from one distribution

  // The margin over chance is 30 % plus 0.05 of the box: JPEG blocks make the noise of neighbours alike.
  bool real() const { return distance > 1.3 * by_chance + 0.05; }
};

// `inner` against the rest of `outer`, both within the image. NaN, which is not real(), where either is
// empty.
ColorDifference color_difference(const RgbView& image, const ImagePart& inner, const ImagePart& outer);

}  // namespace sdftrack::contour
