// SPDX-License-Identifier: MIT
#include "tracking/several/play.h"

#include <cmath>

namespace sdftrack::tracking {

namespace {

constexpr int kPlaySteps = 26;              // along a direction, up to what is possible without others
constexpr double kPlayTolerance_m = 0.001;  // a deeper penetration than at the pose itself is a bound
constexpr int kHeldDirections = 4;  // of the six along the camera's axes; beside a wall it is one or two
const double kReachPerSd = std::sqrt(3.0);  // an even distribution has this half width

}  // namespace

Play play_between(const Neighbors& others, const frame::Shape& shape, const Rigidd& T_cam_obj, double sd_m,
                  double sd_rad) {
  const double allowed_m = depth_in(others, shape, T_cam_obj) + kPlayTolerance_m;
  Play play;
  play.covariance.setZero();
  int bounded = 0;
  for (int axis = 0; axis < 6; ++axis) {
    const double most = kReachPerSd * (axis < 3 ? sd_m : sd_rad);
    double reach[2] = {most, most};
    for (int side = 0; side < 2; ++side)
      for (int step = 1; step <= kPlaySteps; ++step) {
        Vec3d along{0, 0, 0};
        const double way = (side == 0 ? -most : most) * step / kPlaySteps;
        (axis % 3 == 0 ? along.x : axis % 3 == 1 ? along.y : along.z) = way;
        const Rigidd moved = axis < 3 ? Rigidd{T_cam_obj.R, T_cam_obj.t + along}
                                      : Rigidd{rotation_exp(along) * T_cam_obj.R, T_cam_obj.t};
        if (depth_in(others, shape, moved) <= allowed_m) continue;
        reach[side] = std::abs(way);
        bounded += axis < 3;
        break;
      }
    // Mean square of a position that is anywhere between the bounds, about the pose.
    play.covariance(axis, axis) = (reach[0] * reach[0] - reach[0] * reach[1] + reach[1] * reach[1]) / 3;
  }
  const Vec3d r = T_cam_obj.R * -shape.centre_obj;  // the caller's origin turns about the middle
  Eigen::Matrix<double, 6, 6> shift = Eigen::Matrix<double, 6, 6>::Identity();
  shift(0, 4) = r.z, shift(0, 5) = -r.y, shift(1, 3) = -r.z, shift(1, 5) = r.x, shift(2, 3) = r.y,
           shift(2, 4) = -r.x;
  play.covariance = shift * play.covariance * shift.transpose();
  play.held = bounded >= kHeldDirections;
  return play;
}

}  // namespace sdftrack::tracking
