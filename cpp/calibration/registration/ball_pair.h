// SPDX-License-Identifier: MIT
// The ball in both images of a frame.
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

#include "base/vec.h"

namespace sdftrack::calibration {

constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();

struct BallPair {
  std::int64_t index = 0;  // of the frame
  Vec3d center_cam{};      // at the time of the depth image, depth camera, m
  Eigen::Matrix3d center_covariance;
  // Of the ball's centre, not of the outline's; NaN: no cone fits the outline.
  Vec2d color_px{kUnknown, kUnknown};
  Eigen::Matrix2d color_covariance = Eigen::Matrix2d::Constant(kUnknown);
  double radius_px = 0, time_s = kUnknown;
};
using BallPairs = std::vector<BallPair>;
using Chosen = std::vector<std::uint8_t>;  // 0 or 1 for each pair

inline bool is_finite(Vec2d p) { return std::isfinite(p.x) && std::isfinite(p.y); }
inline bool is_finite(Vec3d p) { return std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z); }
inline std::size_t count_of(const Chosen& chosen) {
  std::size_t n = 0;
  for (const std::uint8_t c : chosen) n += c != 0;
  return n;
}

}  // namespace sdftrack::calibration
