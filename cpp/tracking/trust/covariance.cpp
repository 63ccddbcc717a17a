// SPDX-License-Identifier: MIT
#include "tracking/trust/covariance.h"

#include <Eigen/Cholesky>
#include <numbers>

#include "optim/camera_increment.h"
#include "optim/dense.h"

namespace sdftrack::tracking {

namespace {

// Projects out the directions along which the inliers' residuals hardly change.
Matrix6d seen_directions(const energies::EnergySummary& sums, const frame::Shape& shape) {
  const Vector6d unit = comparable_units(shape);
  const Matrix6d geometry = unit.asDiagonal() * sums.geometry * unit.asDiagonal();
  // Usually no direction is blind, which is cheaper to find than the directions.
  const Matrix6d beyond = geometry - kBlindSlope * kBlindSlope * Matrix6d::Identity();
  if (Eigen::LLT<Matrix6d>(beyond).info() == Eigen::Success) return Matrix6d::Identity();
  const optim::Eigenpairs<6> directions = optim::eigenpairs(geometry);
  Matrix6d seen = Matrix6d::Zero();
  for (int i = 0; i < 6; ++i)
    if (directions.values[i] >= kBlindSlope * kBlindSlope)
      seen += directions.vectors.col(i) * directions.vectors.col(i).transpose();
  return unit.cwiseInverse().asDiagonal() * seen * unit.asDiagonal();
}

}  // namespace

Vector6d comparable_units(const frame::Shape& shape) {
  Vector6d unit;
  unit << 1, 1, 1, Eigen::Vector3d::Constant(2 / shape.diameter_m);
  return unit;
}

Matrix6d weak_knowledge(const frame::Shape& shape) {
  Eigen::Matrix<double, 6, 1> sd;
  sd << Eigen::Vector3d::Constant(shape.diameter_m), Eigen::Vector3d::Constant(std::numbers::pi);
  return sd.cwiseAbs2().cwiseInverse().asDiagonal();
}

Matrix6d increment_covariance(const energies::EnergySummary& sums, const frame::Shape& shape,
                              double correlation_area_px) {
  const double diameter_m = shape.diameter_m;
  Eigen::Matrix<double, 6, 1> prior_sd;
  prior_sd << Eigen::Vector3d::Constant(diameter_m), Eigen::Vector3d::Constant(std::numbers::pi);
  const Matrix6d prior = prior_sd.cwiseAbs2().cwiseInverse().asDiagonal();
  if (!(sums.inliers > 0)) return prior_sd.cwiseAbs2().asDiagonal();

  const Matrix6d P = seen_directions(sums, shape);
  const Matrix6d A = P * sums.A * P.transpose() + prior;
  const Matrix6d B = correlation_area_px * (P * sums.B * P.transpose()) + prior;
  const Matrix6d A_inverse = optim::inverse_symmetric<6>(A);
  Matrix6d C = A_inverse * B * A_inverse.transpose();
  for (const energies::SmallVector* bias : {&sums.rounding, &sums.missed}) {
    const Eigen::Matrix<double, 6, 1> shift = A_inverse * (P * *bias);
    C += shift * shift.transpose();
  }
  return 0.5 * (C + C.transpose());
}

Matrix6d increment_response(const energies::EnergySummary& sums, const frame::Shape& shape) {
  if (!(sums.inliers > 0)) return Matrix6d::Zero();
  const Matrix6d P = seen_directions(sums, shape);
  return optim::solve_symmetric<6, 6>(Matrix6d(P * sums.A * P.transpose() + weak_knowledge(shape)), P);
}

Matrix6d without_slips(const Matrix6d& information, const frame::Shape& shape) {
  if (shape.slips.empty()) return information;
  Matrix6d keep = Matrix6d::Identity();
  for (const std::array<double, 6>& slip : shape.slips) {
    const Eigen::Map<const Vector6d> s(slip.data());
    keep -= s * s.transpose();
  }
  const Vector6d unit = comparable_units(shape);
  const Matrix6d P = unit.cwiseInverse().asDiagonal() * keep * unit.asDiagonal();
  return P * information * P.transpose();
}

Matrix6d camera_covariance(const Matrix6d& increment, const Rigidd& T_cam_obj, Vec3d origin_obj) {
  const Matrix6d J = optim::camera_by_increment(T_cam_obj, origin_obj);
  const Matrix6d C = J * increment * J.transpose();
  return 0.5 * (C + C.transpose());
}

Matrix6d increment_information(const Matrix6d& camera, const Rigidd& T_cam_obj, Vec3d origin_obj) {
  const Matrix6d J = optim::camera_by_increment(T_cam_obj, origin_obj);
  const Matrix6d C = J.transpose() * optim::solve_symmetric<6, 6>(camera, J);
  return 0.5 * (C + C.transpose());
}

}  // namespace sdftrack::tracking
