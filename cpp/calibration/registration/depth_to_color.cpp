// SPDX-License-Identifier: MIT
#include "calibration/registration/depth_to_color.h"

#include <algorithm>

#include "calibration/ball/cone.h"
#include "calibration/registration/ball_pair.h"

namespace sdftrack::calibration {

namespace {

constexpr double kStep_m = 1e-6;  // of the numerical derivative through a lens

Eigen::Vector3d eigen(Vec3d v) { return {v.x, v.y, v.z}; }
Eigen::Matrix3d eigen(const Mat3d& A) {
  Eigen::Matrix3d out;
  out << A.r0.x, A.r0.y, A.r0.z, A.r1.x, A.r1.y, A.r1.z, A.r2.x, A.r2.y, A.r2.z;
  return out;
}
Vec3d plain(const Eigen::Vector3d& v) { return {v[0], v[1], v[2]}; }

Eigen::Matrix3d matrix_of(const Intrinsics<double>& K) {
  Eigen::Matrix3d out;
  out << K.fx, 0, K.cx, 0, K.fy, K.cy, 0, 0, 1;
  return out;
}
Eigen::Matrix3d inverse_of(const Intrinsics<double>& K) {
  Eigen::Matrix3d out;
  out << 1 / K.fx, 0, -K.cx / K.fx, 0, 1 / K.fy, -K.cy / K.fy, 0, 0, 1;
  return out;
}

DepthToColor::Pixel through_matrix(const ProjectiveMatrix& M, Vec3d p_cam) {
  const Eigen::Vector4d p(p_cam.x, p_cam.y, p_cam.z, 1);
  const Eigen::Vector3d y = M * p;
  DepthToColor::Pixel out;
  out.by_map.setZero();
  const double px[2] = {y[0] / y[2], y[1] / y[2]};
  for (int k = 0; k < 2; ++k) {
    out.by_map.block<1, 4>(k, 4 * k) = p.transpose() / y[2];
    out.by_map.block<1, 4>(k, 8) = -p.transpose() * (px[k] / y[2]);
    out.by_point.row(k) = (M.block<1, 3>(k, 0) - px[k] * M.block<1, 3>(2, 0)) / y[2];
  }
  out.px = y[2] > 0 ? Vec2d{px[0], px[1]} : Vec2d{kUnknown, kUnknown};
  return out;
}

DepthToColor::Pixel through_camera(const Rigidd& T, const Camera& color, Vec3d p_cam) {
  const Vec3d p = T * p_cam;
  DepthToColor::Pixel out;
  out.px = pixel_of(color, p);
  Eigen::Matrix<double, 2, 3> by_eye;
  for (int k = 0; k < 3; ++k) {
    const Vec3d e = plain(kStep_m * Eigen::Vector3d::Unit(k));
    const Vec2d ahead = pixel_of(color, p + e), behind = pixel_of(color, p - e);
    by_eye.col(k) << (ahead.x - behind.x) / (2 * kStep_m), (ahead.y - behind.y) / (2 * kStep_m);
  }
  out.by_map.setZero();
  out.by_map.leftCols<3>() = by_eye;
  out.by_map.block<2, 3>(0, 3) = -by_eye * eigen(hat(p));
  out.by_point = by_eye * eigen(T.R);
  return out;
}

}  // namespace

DepthToColor::DepthToColor(const ProjectiveMatrix& M)
    : M_(M / std::max(M.block<1, 3>(2, 0).norm(), 1e-300)) {}

DepthToColor::Pixel DepthToColor::at(Vec3d p_cam) const {
  return color_ ? through_camera(T_color_depth_, *color_, p_cam) : through_matrix(M_, p_cam);
}

DepthToColor DepthToColor::moved(const Eigen::VectorXd& step) const {
  if (color_) {
    const Rigidd by{rotation_exp(Vec3d{step[3], step[4], step[5]}), {step[0], step[1], step[2]}};
    return {by * T_color_depth_, *color_};
  }
  ProjectiveMatrix M = M_;
  for (int i = 0; i < kMaxMapUnknowns; ++i) M(i / 4, i % 4) += step[i];
  return DepthToColor(M);
}

Eigen::VectorXd DepthToColor::scales() const {
  Eigen::VectorXd out = Eigen::VectorXd::Ones(unknowns());
  if (!color_)
    out.head<4>().setConstant(std::abs(M_(0, 0))), out.segment<4>(4).setConstant(std::abs(M_(1, 1)));
  return out;
}

Eigen::VectorXd DepthToColor::free_direction() const {
  Eigen::VectorXd out(kMaxMapUnknowns);
  for (int i = 0; i < kMaxMapUnknowns; ++i) out[i] = M_(i / 4, i % 4);
  return out.cwiseQuotient(scales()).normalized();
}

DepthToColor::Pq DepthToColor::Pq_of(const Intrinsics<double>& depth) const {
  const Eigen::Matrix3d K_inv = inverse_of(depth);
  Eigen::Matrix3d P;
  Eigen::Vector3d q;
  Pq out;
  out.by_map.setZero(12, unknowns());
  const auto put = [](const Eigen::Matrix3d& of_P, const Eigen::Vector3d& of_q, auto&& column) {
    for (int i = 0; i < 9; ++i) column[i] = of_P(i / 3, i % 3);
    column.template tail<3>() = of_q;
  };
  if (color_) {
    const Eigen::Matrix3d K = matrix_of(color_->K), R = eigen(T_color_depth_.R);
    const Eigen::Vector3d t = eigen(T_color_depth_.t);
    P = K * R * K_inv, q = K * t;
    for (int k = 0; k < 3; ++k) {
      const Eigen::Vector3d e = Eigen::Vector3d::Unit(k);
      const Eigen::Matrix3d turn = eigen(hat(plain(e)));
      put(Eigen::Matrix3d::Zero(), K.col(k), out.by_map.col(k));
      put(K * turn * R * K_inv, K * turn * t, out.by_map.col(3 + k));
    }
  } else {
    P = M_.leftCols<3>() * K_inv, q = M_.col(3);
    // Changes of M, projected onto those that keep |M[2, :3]| = 1.
    for (int k = 0; k < kMaxMapUnknowns; ++k) {
      ProjectiveMatrix change = ProjectiveMatrix::Zero();
      change(k / 4, k % 4) = 1;
      if (k >= 8 && k < 11) change -= M_(2, k - 8) * M_;
      put(change.leftCols<3>() * K_inv, change.col(3), out.by_map.col(k));
    }
  }
  put(P, q, out.values);
  return out;
}

std::optional<CameraAndPlace> decompose(const ProjectiveMatrix& M) {
  const Vec3d a = plain(M.block<1, 3>(0, 0)), b = plain(M.block<1, 3>(1, 0)), c = plain(M.block<1, 3>(2, 0));
  if (!(dot(a, cross(b, c)) > 0)) return std::nullopt;
  // The rows of K' R', from the last one up: K' is upper triangular.
  Eigen::Matrix3d K = Eigen::Matrix3d::Zero();
  K(2, 2) = norm(c);
  const Vec3d r2 = (1 / K(2, 2)) * c;
  K(1, 2) = dot(b, r2);
  const Vec3d rest = b - K(1, 2) * r2;
  K(1, 1) = norm(rest);
  const Vec3d r1 = (1 / K(1, 1)) * rest, r0 = cross(r1, r2);
  K.row(0) << dot(a, r0), dot(a, r1), dot(a, r2);
  const Eigen::Vector3d t = K.triangularView<Eigen::Upper>().solve(M.col(3));
  return CameraAndPlace{K / K(2, 2), {{r0, r1, r2}, plain(t)}};
}

}  // namespace sdftrack::calibration
