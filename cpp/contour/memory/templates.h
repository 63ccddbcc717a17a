// SPDX-License-Identifier: MIT
// Silhouettes as rows of weights, so that the costs of all of them at all places are one matrix product.
//
// With e = 2 p - 1 the evidence for the object at a pixel, the cost of a silhouette M at a place is
//
//   cost = 1 - (sum of e+ where M is - kLacking * sum of e- where M is) / area + priors.
//
// The edge of M is soft over a few pixels, so that the sums are inner products of two images.
#pragma once

#include <array>
#include <vector>

#include "contour/memory/plane.h"

namespace sdftrack::contour {

constexpr int kFrame = 64;  // side of the searched frame, independent of the memory's

// A search around a place: shifts of up to `reach` blocks along each axis, at each listed size and angle.
struct Stage {
  struct Try {
    double log_scale = 0, angle_rad = 0;
  };
  int block, reach;  // px, blocks
  std::vector<Try> tries;

  int side() const { return kFrame / block; }
  int length() const { return 2 * side() * side(); }  // of a template
  int places() const { return (2 * reach + 1) * (2 * reach + 1); }
};

// The coarse and fine stages for the templates of stored silhouettes; then the stages for their average.
const std::array<Stage, 2>& stored_stages();
const std::array<Stage, 2>& last_stages();

// Weights of the evidence for the object, then of the evidence against it, at each block of a silhouette's
// frame. `phi`: signed distances on the memory's grid, in pixels.
std::vector<float> template_of(const Picture& phi, const Stage& stage);

}  // namespace sdftrack::contour
