// SPDX-License-Identifier: MIT
// Sub-pixel edges between an object of uniform colour and its surroundings.
#pragma once

#include "calibration/ball/rgb.h"

namespace sdftrack::calibration {

struct Edge {
  Vec2d at;         // px
  bool sure;        // whether the profile is an edge's
  double width_px;  // of the edge's blur
};

// The edge along a normal that points out of the object, near `at` and, with its blur, within reach_px of it.
// Coverage is measured along a colour direction in which the two sides differ, but which is insensitive to
// the brightness of the inner colour, so that shading does not shift edges (docs/math/color_to_depth.md, eq.
// 9). The sum of coverage gives the edge's position.
Edge edge_along(const RgbImage& image, Vec2d at, Vec2d normal, double reach_px);

}  // namespace sdftrack::calibration
