// SPDX-License-Identifier: MIT
// The motion of T_cam_obj by the increment (v, w) of T_obj_cam.
#pragma once

#include <Eigen/Core>

#include "base/rigid.h"

namespace sdftrack::optim {

// Derivative of (x, y, z, rx, ry, rz) in camera axes, t = t^ + d, R = Exp(r) R^, about the point `origin_obj`
// of the object frame. T_cam_obj <- T_cam_obj increment(v, w)^-1: the object frame's origin moves by -R v,
// the rotation is -R w, and `origin_obj` also moves by the rotation crossed with its lever arm R origin_obj.
Eigen::Matrix<double, 6, 6> camera_by_increment(const Rigidd& T_cam_obj, Vec3d origin_obj);

}  // namespace sdftrack::optim
