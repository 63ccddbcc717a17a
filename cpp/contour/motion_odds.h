// SPDX-License-Identifier: MIT
// The optical flow as a second cue in addition to the colours: whether a pixel moves as the object or as its
// surroundings (docs/math/contour.md, section 8).
#pragma once

#include <cstddef>
#include <vector>

#include "contour/region_model.h"

namespace sdftrack::contour {

// For each pixel of a part of the image, the offset to its place in the last image, in pixels (x, y).
struct FlowView {
  const float* back;
  ImagePart part;

  const float* at(int x, int y) const {
    return back + 2 * (std::ptrdiff_t(y - part.y0) * part.width() + (x - part.x0));
  }
};

// Map from this image to the last one: (c, -s; s, c) p + t.
struct Similarity {
  double c = 1, s = 0, t[2] = {0, 0};
};

// Pixels and their places in the last image.
struct MotionPairs {
  std::vector<float> x, y, last_x, last_y, error, some;
  std::vector<std::size_t> kept;
};

// The motions of the object and of its surroundings. trust: of the flow, from 0 (not at all) to 1.
struct MotionCue {
  FlowView flow{nullptr, {0, 0, 0, 0}};  // no flow: no information
  Similarity object, others;
  double trust = 0;
};

// The similarities that best fit the flow of the object and of its surroundings, with outliers left out;
// `grid` is at its place in the last image. False where too few pixels are seen.
bool fit_motions(const FlowView& flow, const ContourGrid& grid, MotionPairs* object, MotionPairs* others,
                 MotionCue* cue);
// Multiplies the odds of each pixel by how much likelier its motion is the object's.
void weigh_by_motion(const MotionCue& cue, float min_posterior, PosteriorImage* posterior);

}  // namespace sdftrack::contour
