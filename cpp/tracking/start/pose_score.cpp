// SPDX-License-Identifier: MIT
#include "tracking/start/pose_score.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "render/raycast_sdf.h"

namespace sdftrack::tracking {

namespace {

// A measurement this near to the model's depth shows its surface; the second one per metre of distance.
constexpr float kOnSurface_m = 0.006f, kOnSurfacePerMetre = 0.01f;
constexpr int kClick_px = 4;             // a pose is of another thing where nothing of it lies this near
constexpr double kOccludedWeight = 0.5;  // of what is hidden, which is no evidence either way

}  // namespace

double score_pose(const frame::Shape& shape, const frame::DepthFrame& frame, const Camera& camera,
                  const Rigidd& T_cam_obj, const frame::PixelMask& region, Pixel px, int threads) {
  const std::vector<float> expected_m = render::raycast_sdf(shape.sdf, camera, T_cam_obj, threads).depth_m;
  double agree = 0, past = 0, front = 0, in_region = 0;
  bool at_click = false;
  for (int y = 0; y < camera.height; ++y)
    for (int x = 0; x < camera.width; ++x) {
      const float expected = expected_m[region.at(x, y)], z = frame.depth_m(x, y);
      if (!(expected > 0)) continue;
      const float near = kOnSurface_m + kOnSurfacePerMetre * expected;
      past += z > expected + near;
      front += z > 0 && z < expected - near;
      if (!(std::abs(z - expected) < near)) continue;
      ++agree;
      in_region += region(x, y);
      at_click = at_click || std::max(std::abs(x - px.x), std::abs(y - px.y)) <= kClick_px;
    }
  if (!at_click) return 0;
  const double seen = agree / std::max(1.0, agree + past + kOccludedWeight * front);
  return seen * in_region / std::max(1, frame::count(region));
}

}  // namespace sdftrack::tracking
