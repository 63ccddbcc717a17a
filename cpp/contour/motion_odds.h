// SPDX-License-Identifier: MIT
// The optical flow as a second cue beside the colours: does a pixel move as the object, or as what is around
// it? (docs/math/contour.md, section 8)
#pragma once

#include <cstddef>
#include <vector>

#include "contour/region_model.h"

namespace sdftrack::contour {

// For each pixel of a part of the image, how far its place in the last image is from it, in pixels (x, y).
struct FlowView {
  const float* back;
  ImagePart part;

  const float* at(int x, int y) const {
    return back + 2 * (static_cast<std::ptrdiff_t>(y - part.y0) * part.width() + (x - part.x0));
  }
};

// From this image to the last: (c, -s; s, c) p + t.
struct Similarity {
  double c = 1, s = 0, t[2] = {0, 0};
};

// Pixels and where they were.
struct MotionPairs {
  std::vector<float> x, y, last_x, last_y, error, sorted;
};

// By pixel of `part`: how much likelier its motion is the object's.
struct MotionOdds {
  ImagePart part{0, 0, 0, 0};
  std::vector<float> values;
};

// The similarity that fits the flow of the object, or of what is around it, best, pixels that do not follow
// it left out; `grid` lies where it lay in the last image. False where too few pixels are seen.
bool fit_motion(const FlowView& flow, const ContourGrid& grid, bool object, MotionPairs* pairs,
                Similarity* motion);
// trust: 0, none, to 1. Where both move alike the odds are 1.
void motion_odds(const FlowView& flow, const Similarity& object, const Similarity& others, double trust,
                 MotionOdds* out);
void combine_odds(const MotionOdds& odds, float min_posterior, PosteriorImage* posterior);

}  // namespace sdftrack::contour
