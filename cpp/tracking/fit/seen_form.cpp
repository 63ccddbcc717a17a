// SPDX-License-Identifier: MIT
#include "tracking/fit/seen_form.h"

#include <algorithm>
#include <cmath>

namespace sdftrack::tracking {

namespace {

constexpr double kSlope = 0.045, kSlopePerVoxel = 1.5;  // over half the diameter
constexpr double kHalfPerSpread = 1.5;                // of the root mean square distance from the middle

// turn: by which turns are multiplied.
Vector6d row_of(const Vec3f& normal, const Vec3d& p_obj, double turn) {
  const Vec3d n = normal.cast<double>(), m = turn * cross(p_obj, n);
  Vector6d J;
  J << n.x, n.y, n.z, m.x, m.y, m.z;
  return J;
}

// Half a diameter of the seen part, about; that of the shape is as large as its volume may become.
double seen_half(const frame::Moments& m) {
  const double square = m.square.r0.x + m.square.r1.y + m.square.r2.z - dot(m.mean, m.mean);
  return kHalfPerSpread * std::sqrt(std::max(square, 1e-12));
}

}  // namespace

double least_form_slope(const frame::Shape& shape) {
  return std::hypot(kSlope,
                    kSlopePerVoxel * static_cast<double>(shape.sdf.voxel_m) / seen_half(shape.moments));
}

Matrix6d seen_form(const frame::DepthFrame& frame, const Camera& camera, const frame::Shape& shape,
                   const Rigidd& T_cam_obj, double tolerance_m) {
  Matrix6d sum = Matrix6d::Zero();
  const Vec3d eye_obj = inverse(T_cam_obj).t;
  const double turn = 0.5 * shape.diameter_m / seen_half(shape.moments);
  int count = 0;
  for (std::size_t i = 0; i < shape.smooth_normals[0].size(); ++i) {
    const Vec3d p_obj = shape.points[i].cast<double>();
    if (!(dot(shape.normals[i].cast<double>(), eye_obj - p_obj) > 0)) continue;
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
