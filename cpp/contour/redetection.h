// SPDX-License-Identifier: MIT
// Search for a lost object in the whole image at many sizes (docs/math/contour.md, section 6).
#pragma once

#include <vector>

#include "contour/search.h"

namespace sdftrack::contour {

// A box of the image with more of the object's colours inside than around.
struct BoxFound {
  double score, scale, u, v;  // of the warp: its size over the last one, its translation, in squares
};

struct RedetectionWork {
  PosteriorImage posterior;   // of squares of pixels, in coordinates of the squares
  std::vector<double> table;  // sums over all squares above and to the left
  std::vector<BoxFound> found;
};

// The place and size, at the rotation of `warp`, where the shape of `samples` has the highest contrast.
// Returns that contrast and sets the warp. The run time does not grow with the image.
double find_anywhere(const RgbView& image, const RegionModel& model, const ShapeSamples& samples,
                     RedetectionWork* work, GridWarp* warp);

}  // namespace sdftrack::contour
