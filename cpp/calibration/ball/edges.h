// SPDX-License-Identifier: MIT
// Sub-pixel edges between an object of uniform colour and its surroundings.
#pragma once

#include "calibration/ball/rgb.h"

namespace sdftrack::calibration {

struct Edge {
  Vec2d at;         // px
  bool sure;        // whether the profile is that of an edge
  double width_px;  // of its blur
};

// The edge along a normal that points out of the object, near `at` and no farther from it, its blur included,
// than reach_px. Coverage is measured along the colour direction in which the two sides differ but which is
// insensitive to the brightness of the inner colour, so that shading does not move edges
// (docs/math/color_to_depth.md, eq. 9). The edge's place is the sum of coverage.
Edge edge_along(const RgbImage& image, Vec2d at, Vec2d normal, double reach_px);

}  // namespace sdftrack::calibration
