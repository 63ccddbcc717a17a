// SPDX-License-Identifier: MIT
// Pixels that may be the nearest point of a ball: depth on three rings must match a sphere, and a ring around
// it must lie behind (docs/math/color_to_depth.md, eq. 5).
#pragma once

#include <vector>

#include "base/camera.h"
#include "base/to_int.h"
#include "base/views.h"

namespace sdftrack::calibration {

constexpr double kFarthest_m = 5;
constexpr double kMinShare = 0.4;   // share of the ball's pixels that agree: a hand may hide half of it
constexpr double kMinFree = 0.5;    // share of the pixels around the ball that lie behind it
constexpr double kOuterRing = 1.3;  // of the ball's radius

struct NearestPoint {
  int u, v;
  double z, radius_px, score;
};

// Every fourth pixel is tested. `smooth`: a depth image without isolated wrong pixels.
std::vector<NearestPoint> nearest_points(const ImageView<float>& smooth, const Camera& camera,
                                         double radius_m);

// `count` directions around the circle, the first one at `start` steps.
std::vector<Vec2d> directions(int count, double start);

// Nearest measurement; -1 outside the image.
inline double depth_at(const ImageView<float>& depth, double u, double v) {
  if (!(u > -0.5 && v > -0.5)) return -1;
  const int x = to_int(u + 0.5), y = to_int(v + 0.5);
  return x < depth.width && y < depth.height ? double(depth(x, y)) : -1.0;
}

}  // namespace sdftrack::calibration
