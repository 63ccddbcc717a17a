// SPDX-License-Identifier: MIT
#include "tracking/trust/open_directions.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <cstdio>

#include "base/portable_math.h"
#include "optim/dense.h"

namespace sdftrack::tracking {

namespace {

constexpr double kSlope = 0.045, kSlopePerVoxel = 1.5;  // over half the diameter
constexpr double kHalfPerSpread = 1.5;                  // of the root mean square distance from the middle
constexpr double kOpenShare = 0.2;      // of the radius: sd above which a direction counts as open
constexpr double kRest_m = 2e-4;        // an unobserved direction is fixed except for this per frame
constexpr double kBlindShare = 1.0;     // of the radius: sd from which nothing at all is observed
constexpr double kFollows = 0.5;        // of the sd, per frame, where a little is observed
constexpr double kSmallTurn_rad = 0.1;  // a declared symmetry of a smaller turn is one of a continuous set
constexpr double kAlong = 0.97;         // cosine of two axes that count as one

Eigen::Vector3d to_eigen(const Vec3d& v) { return {v.x, v.y, v.z}; }

// Mean of D^T D over the surface, D = [I, -[p]x] the displacement of a point p by (v, w).
Matrix6d surface_metric(const frame::Shape& shape) {
  const Eigen::Vector3d mean = to_eigen(shape.moments.mean);
  const Eigen::Matrix3d square = square_of(shape.moments);
  Matrix6d M = Matrix6d::Identity();
  Eigen::Matrix3d cross;
  cross << 0, -mean.z(), mean.y(), mean.z(), 0, -mean.x(), -mean.y(), mean.x(), 0;
  M.topRightCorner<3, 3>() = -cross;
  M.bottomLeftCorner<3, 3>() = cross;
  M.bottomRightCorner<3, 3>() = square.trace() * Eigen::Matrix3d::Identity() - square;
  // Points on a line have no extent across it.
  M.bottomRightCorner<3, 3>().diagonal().array() += 1e-4 * square.trace() + 1e-12;
  return M;
}

// An axis has no sign: its largest part is positive.
Eigen::Vector3d without_sign(const Eigen::Vector3d& axis) {
  Eigen::Index largest;
  axis.cwiseAbs().maxCoeff(&largest);
  return axis[largest] < 0 ? Eigen::Vector3d(-axis) : axis;
}

// turn: factor of the rotational part.
Vector6d row_of(const Vec3f& normal, const Vec3d& p_obj, double turn) {
  const Vec3d n = normal.cast<double>(), m = turn * cross(p_obj, n);
  Vector6d J;
  J << n.x, n.y, n.z, m.x, m.y, m.z;
  return J;
}

// About half a diameter of the seen part; that of the shape is as large as its volume may become.
double seen_half(const frame::Moments& m) {
  const double square = m.square.r0.x + m.square.r1.y + m.square.r2.z - dot(m.mean, m.mean);
  return kHalfPerSpread * std::sqrt(std::max(square, 1e-12));
}

std::string shown(const Eigen::Vector3d& v) {
  char text[64];
  // Adding 0 turns -0 into 0.
  const auto rounded = [](double x) { return std::round(100 * x) / 100 + 0.0; };
  std::snprintf(text, sizeof text, "(%.2f, %.2f, %.2f)", rounded(v.x()), rounded(v.y()), rounded(v.z()));
  return text;
}

}  // namespace

Eigen::Matrix3d square_of(const frame::Moments& moments) {
  Eigen::Matrix3d square;
  square << to_eigen(moments.square.r0), to_eigen(moments.square.r1),
      to_eigen(moments.square.r2);  // symmetric: rows are columns
  return square;
}

OpenDirections::OpenDirections(const Matrix6d& covariance, const Rigidd& T_cam_obj,
                               const frame::Shape& shape) {
  const Matrix6d M = surface_metric(shape);
  radius_m_ = std::sqrt(0.5 * M.bottomRightCorner<3, 3>().trace());
  const double least_m = kOpenShare * radius_m_;
  // Most frames determine all directions: then none moves the surface by more than all of them together.
  const Matrix6d C =
      optim::inverse_symmetric<6>(increment_information(covariance, T_cam_obj, -shape.centre_obj));
  if (!((C * M).trace() > least_m * least_m)) return;
  const Matrix6d L = M.llt().matrixL();
  const optim::Eigenpairs<6> modes = optim::eigenpairs(Matrix6d(L.transpose() * C * L));
  for (int i = 5; i >= 0; --i) {
    if (!(modes.values[i] > least_m * least_m)) continue;
    const Vector6d e = modes.vectors.col(i);
    all_.push_back(
        {L.transpose().triangularView<Eigen::Upper>().solve(e), L * e, std::sqrt(modes.values[i])});
  }
}

Matrix6d OpenDirections::hold() const {
  Matrix6d information = Matrix6d::Zero();
  for (const OpenDirection& d : all_) {
    const double step_m = d.sd_m > kBlindShare * radius_m_ ? kRest_m : kFollows * d.sd_m;
    information += d.part * d.part.transpose() / (step_m * step_m);
  }
  return information;
}

void OpenDirections::remove_from(const Rigidd& T_cam_obj, Vec3d* v, Vec3d* w) const {
  if (empty()) return;
  const Mat3d R_obj_cam = transpose(T_cam_obj.R);
  Vector6d increment;
  increment << to_eigen(-(R_obj_cam * *v)), to_eigen(-(R_obj_cam * *w));
  for (const OpenDirection& d : all_) increment -= d.part.dot(increment) * d.increment;
  *v = T_cam_obj.R * Vec3d{-increment[0], -increment[1], -increment[2]};
  *w = T_cam_obj.R * Vec3d{-increment[3], -increment[4], -increment[5]};
}

std::string OpenDirections::unexplained(const std::vector<Rigidd>& symmetries, bool turns_are_free) const {
  std::vector<Eigen::Vector3d> turns, shifts;
  for (const OpenDirection& d : all_) {
    if (!d.turns(radius_m_)) {
      shifts.push_back(without_sign(d.increment.head<3>().normalized()));
      continue;
    }
    const Eigen::Vector3d axis = without_sign(d.increment.tail<3>().normalized());
    bool declared = turns_are_free;
    for (const Rigidd& S : symmetries) {
      const Eigen::Vector3d turn = to_eigen(rotation_log(S.R));
      declared |= turn.norm() < kSmallTurn_rad && std::abs(turn.normalized().dot(axis)) > kAlong;
    }
    if (!declared) turns.push_back(axis);
  }
  if (turns.empty() && shifts.empty()) return {};
  std::string text;
  if (turns.size() == 1) text = "the rotation about the axis " + shown(turns[0]);
  if (turns.size() > 1) text = "the rotation";
  for (const Eigen::Vector3d& along : shifts)
    text += (text.empty() ? "the position along " : " and the position along ") + shown(along);
  text += turns.size() + shifts.size() > 1 ? " are not observed" : " is not observed";
  if (turns.size() > 1 && shifts.empty())
    text = "the rotation about " + std::to_string(turns.size()) + " axes is not observed";
  if (!turns.empty()) text += "; pass symmetry= or a mesh with colours";
  return text;
}

double least_form_slope(const frame::Shape& shape) {
  return hypotenuse(kSlope, kSlopePerVoxel * double(shape.sdf.voxel_m) / seen_half(shape.moments));
}

Matrix6d seen_form(const frame::DepthFrame& frame, const Camera& camera, const frame::Shape& shape,
                   const Rigidd& T_cam_obj, double tolerance_m) {
  Matrix6d sum = Matrix6d::Zero();
  const Vec3d eye_obj = inverse(T_cam_obj).t;
  const double turn = 0.5 * shape.diameter_m / seen_half(shape.moments);
  int count = 0;
  for (std::size_t i = 0; i < shape.smooth_normals[0].size(); ++i) {
    const std::size_t k = frame::kSmoothEvery * i;
    const Vec3d p_obj = shape.points[k].cast<double>();
    if (!(dot(shape.normals[k].cast<double>(), eye_obj - p_obj) > 0)) continue;
    const Vec3d p_cam = T_cam_obj * p_obj;
    const double z_m = p_cam.z > 0 ? frame::reading_at(frame, camera, p_cam) : 0;
    if (!(z_m > 0) || std::abs(z_m - p_cam.z) > tolerance_m) continue;
    const Vector6d a = row_of(shape.smooth_normals[0][i], p_obj, turn),
                   b = row_of(shape.smooth_normals[1][i], p_obj, turn);
    const Vector6d d = a - b;
    sum.noalias() += 0.5 * (a * b.transpose() + b * a.transpose() - d * d.transpose());
    ++count;
  }
  if (count > 0) sum /= count;
  return sum;
}

}  // namespace sdftrack::tracking
