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
  std::vector<float> x, y, last_x, last_y, error, some;
  std::vector<std::size_t> kept;
};

// How the object moves and how what is around it does, as far as the flow is trusted: 0, not at all, to 1.
struct MotionCue {
  FlowView flow{nullptr, {0, 0, 0, 0}};  // no flow: nothing is known
  Similarity object, others;
  double trust = 0;
};

// The similarities that fit the flow of the object and of what is around it best, pixels that do not follow
// them left out; `grid` lies where it lay in the last image. False where too few pixels are seen.
bool fit_motions(const FlowView& flow, const ContourGrid& grid, MotionPairs* object, MotionPairs* others,
                 MotionCue* cue);
// Multiplies the odds of each pixel by how much likelier its motion is the object's; where both move alike,
// by 1.
void weigh_by_motion(const MotionCue& cue, float min_posterior, PosteriorImage* posterior);

}  // namespace sdftrack::contour
