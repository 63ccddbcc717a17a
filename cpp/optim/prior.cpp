// SPDX-License-Identifier: MIT
#include "optim/prior.h"

#include <Eigen/Dense>

namespace sdftrack {

namespace {

Eigen::Matrix3d eigen_hat(const Vec3d& v) {
  Eigen::Matrix3d K;
  K << 0, -v.z, v.y, v.z, 0, -v.x, -v.y, v.x, 0;
  return K;
}

}  // namespace

double PosePrior::cost(const State& x) {
  const Rigidd D = x.T_obj_cam[static_cast<std::size_t>(object_)] * inverse(T_prior_);
  const Vec3d r = mrp_from_rotation(D.R);
  return 0.5 * dot(D.t, D.t) / (sigma_m_ * sigma_m_) + 8.0 * dot(r, r) / (sigma_rad_ * sigma_rad_);
}

void PosePrior::linearize(const State& x, NormalEquations* out) {
  const Rigidd D = x.T_obj_cam[static_cast<std::size_t>(object_)] * inverse(T_prior_);
  const Vec3d r = mrp_from_rotation(D.R);
  Eigen::Matrix<double, 6, 6> J = Eigen::Matrix<double, 6, 6>::Zero();
  // A small turn w on the left moves t by w x t, and the MRP by ((1 - |r|^2) w + 2 w x r + 2 (r . w) r) / 4.
  J.topLeftCorner<3, 3>().setIdentity();
  J.topRightCorner<3, 3>() = -eigen_hat(D.t);
  const Eigen::Vector3d re(r.x, r.y, r.z);
  J.bottomRightCorner<3, 3>() =
      (1 - re.squaredNorm()) * Eigen::Matrix3d::Identity() - 2 * eigen_hat(r) + 2 * re * re.transpose();

  Eigen::Matrix<double, 6, 1> e;
  e << D.t.x, D.t.y, D.t.z, 4 * r.x, 4 * r.y, 4 * r.z;
  Eigen::Matrix<double, 6, 1> information;
  information.head<3>().setConstant(1 / (sigma_m_ * sigma_m_));
  information.tail<3>().setConstant(1 / (sigma_rad_ * sigma_rad_));

  const int at = unknowns_.object_offset(object_);
  out->hessian.block<6, 6>(at, at) += J.transpose() * information.asDiagonal() * J;
  out->gradient.segment<6>(at) += J.transpose() * information.cwiseProduct(e);
  out->cost += 0.5 * e.dot(information.cwiseProduct(e));
}

}  // namespace sdftrack
