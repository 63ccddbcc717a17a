// SPDX-License-Identifier: MIT
// How far an object that no measurement shows may move between others that it must not penetrate: a ball that
// is carried in a cup.
#pragma once

#include <Eigen/Core>

#include "tracking/trust/neighbors.h"

namespace sdftrack::tracking {

struct Play {
  // Whether the others bound its motion in most directions: it goes where they go.
  bool held = false;
  Eigen::Matrix<double, 6, 6> covariance;  // camera axes, about the caller's object origin
};

// T_cam_obj: of the shape, centred frame. sd_m and sd_rad: of what no other object bounds.
Play play_between(const Neighbors& others, const frame::Shape& shape, const Rigidd& T_cam_obj, double sd_m,
                  double sd_rad);

}  // namespace sdftrack::tracking
