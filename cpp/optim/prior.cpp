// SPDX-License-Identifier: MIT
#include "optim/prior.h"

#include <Eigen/Core>

namespace sdftrack::optim {

namespace {

Eigen::Matrix3d eigen_hat(const Vec3d& v) {
  Eigen::Matrix3d K;
  K << 0, -v.z, v.y, v.z, 0, -v.x, -v.y, v.x, 0;
  return K;
}

// (v, w) of D = increment(v, w).
Eigen::Matrix<double, 6, 1> increment_of(const Rigidd& D) {
  const Vec3d r = mrp_from_rotation(D.R);
  Eigen::Matrix<double, 6, 1> e;
  e << D.t.x, D.t.y, D.t.z, 4 * r.x, 4 * r.y, 4 * r.z;
  return e;
}

}  // namespace

PosePrior::Matrix6d PosePrior::isotropic(double sigma_m, double sigma_rad) {
  const auto information = [](double sigma) { return sigma > 0 ? 1 / (sigma * sigma) : 0.0; };
  Eigen::Matrix<double, 6, 1> diagonal;
  diagonal.head<3>().setConstant(information(sigma_m));
  diagonal.tail<3>().setConstant(information(sigma_rad));
  return diagonal.asDiagonal();
}

double PosePrior::cost(const State& x) {
  const Rigidd D = x.T_obj_cam[static_cast<std::size_t>(object_)] * inverse(T_prior_);
  const Eigen::Matrix<double, 6, 1> e = increment_of(D);
  return 0.5 * e.dot(information_ * e);
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

  const Eigen::Matrix<double, 6, 1> e = increment_of(D);
  const int at = unknowns_.object_offset(object_);
  out->hessian.block<6, 6>(at, at) += J.transpose() * information_ * J;
  out->gradient.segment<6>(at) += J.transpose() * (information_ * e);
  out->cost += 0.5 * e.dot(information_ * e);
}

}  // namespace sdftrack::optim
