// SPDX-License-Identifier: MIT
#include "optim/camera_increment.h"

namespace sdftrack::optim {

namespace {

Eigen::Matrix3d to_eigen(const Mat3d& R) {
  Eigen::Matrix3d M;
  M << R.r0.x, R.r0.y, R.r0.z, R.r1.x, R.r1.y, R.r1.z, R.r2.x, R.r2.y, R.r2.z;
  return M;
}

}  // namespace

Eigen::Matrix<double, 6, 6> camera_by_increment(const Rigidd& T_cam_obj, Vec3d origin_obj) {
  const Eigen::Matrix3d R = to_eigen(T_cam_obj.R);
  const Vec3d lever = T_cam_obj.R * origin_obj;
  Eigen::Matrix<double, 6, 6> J = Eigen::Matrix<double, 6, 6>::Zero();
  J.topLeftCorner<3, 3>() = -R;
  J.bottomRightCorner<3, 3>() = -R;
  J.topRightCorner<3, 3>() = to_eigen(hat(lever)) * R;  // -[lever]x (-R)
  return J;
}

}  // namespace sdftrack::optim
