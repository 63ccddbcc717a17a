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

// The edge along a normal that points out of the object, within reach_px of `at`. Coverage is measured along
// a colour direction in which the two sides differ, but not the shades of the inner colour, so that shading
// does not shift edges; its sum gives the position (docs/math/color_to_depth.md, eq. 9).
Edge edge_along(const RgbImage& image, Vec2d at, Vec2d normal, double reach_px);

}  // namespace sdftrack::calibration
