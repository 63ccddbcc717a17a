// SPDX-License-Identifier: MIT
// The ball's path between frames: cubic Hermite interpolation, slopes from polynomials through up to five
// points: the error of a segment of length h is h^4 / 384 times the fourth derivative (eq. 10 of
// docs/math/color_to_depth.md); with the slopes of Catmull-Rom, h^3 / 60 times the third.
#pragma once

#include <optional>
#include <vector>

#include "base/vec.h"

namespace sdftrack::calibration {

struct TimedPoint {
  double time_s;
  Vec3d center_cam;
};

class BallPath {
 public:
  struct At {
    Vec3d center_cam, velocity;
    double variance_share;  // variance of the centre over that of a measured point
  };

  // `points`: at least two, in the order of time.
  explicit BallPath(std::vector<TimedPoint> points);
  // The path without points where something else was mistaken for the ball: those farther from the line
  // between their neighbours than several times the usual distance plus 3 cm.
  static BallPath through(std::vector<TimedPoint> points);

  double period_s() const { return period_s_; }
  // Empty before its start, after its end and within long gaps.
  std::optional<At> at(double time_s) const;

 private:
  bool is_wide(std::size_t segment) const;
  std::vector<TimedPoint> points_;
  std::vector<Vec3d> slope_;
  double period_s_;
};

}  // namespace sdftrack::calibration
