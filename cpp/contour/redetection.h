// SPDX-License-Identifier: MIT
// What was lost, looked for in the whole image at many sizes (docs/math/contour.md, section 6).
#pragma once

#include <vector>

#include "contour/search.h"

namespace sdftrack::contour {

// A box of the image with more of the object's colours inside than around.
struct BoxFound {
  double score, scale, u, v;  // of the warp: its size over the last one, its translation, squares
};

struct RedetectionWork {
  PosteriorImage posterior;   // of squares of pixels, in their own coordinates
  std::vector<double> table;  // sums over all squares above and to the left
  std::vector<BoxFound> found;
};

// The place and size, at the turn that `warp` has, where the shape of `samples` has the most contrast;
// returns that contrast and sets the warp. In a time that does not grow with the image.
double find_anywhere(const RgbView& image, const RegionModel& model, const ShapeSamples& samples,
                     RedetectionWork* work, GridWarp* warp);

}  // namespace sdftrack::contour
