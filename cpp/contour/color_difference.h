// SPDX-License-Identifier: MIT
// Whether a box has colours that its surroundings lack, or whether noise alone tells the two apart.
#pragma once

#include "contour/region_model.h"

namespace sdftrack::contour {

struct ColorDifference {
  double distance;   // total variation between the two histograms of 16^3 colours, 0 to 1
  double by_chance;  // what it is expected to be where both are draws from one distribution

  // A share of the box, beyond what chance does; as JPEG blocks make noise more alike nearby, chance and 30
  // %.
  bool real() const { return distance > 1.3 * by_chance + 0.05; }
};

// `inner` against the rest of `outer`, both within the image. NaN, and so nothing real, where either is
// empty.
ColorDifference color_difference(const RgbView& image, const ImagePart& inner, const ImagePart& outer);

}  // namespace sdftrack::contour
