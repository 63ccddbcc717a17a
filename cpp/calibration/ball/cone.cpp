// SPDX-License-Identifier: MIT
#include "calibration/ball/cone.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "base/portable_math.h"
#include "calibration/ball/median.h"
#include "optim/dense.h"

namespace sdftrack::calibration {

namespace {

constexpr double kFloor_px = 0.02;
constexpr int kRounds = 6;

double focal(const Camera& camera) { return std::sqrt(camera.K.fx * camera.K.fy); }

// m of d . m = 1 with weights on the rays, and its information matrix.
struct Linear {
  Eigen::Vector3d m;
  Eigen::Matrix3d A;
};
Linear weighted_cone(const std::vector<Vec3d>& rays, const std::vector<double>& weights) {
  Linear out{Eigen::Vector3d::Zero(), Eigen::Matrix3d::Zero()};
  Eigen::Vector3d b = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < rays.size(); ++i) {
    const Eigen::Vector3d d(rays[i].x, rays[i].y, rays[i].z);
    out.A += weights[i] * d * d.transpose();
    b += weights[i] * d;
  }
  out.m = optim::solve_symmetric<3, 1>(out.A, b);
  return out;
}

// Covariance of the axis' image, from the covariance of m.
Eigen::Matrix2d image_covariance(const Camera& camera, const Eigen::Vector3d& m,
                                 const Eigen::Matrix3d& of_m) {
  constexpr double kStep = 1e-6;
  Eigen::Matrix<double, 2, 3> J;
  for (int k = 0; k < 3; ++k) {
    const Eigen::Vector3d e = kStep * Eigen::Vector3d::Unit(k), ahead = m + e, behind = m - e;
    const Vec2d a = pixel_of(camera, {ahead[0], ahead[1], ahead[2]});
    const Vec2d b = pixel_of(camera, {behind[0], behind[1], behind[2]});
    J.col(k) << (a.x - b.x) / (2 * kStep), (a.y - b.y) / (2 * kStep);
  }
  return J * of_m * J.transpose();
}

}  // namespace

Vec2d pixel_of(const Camera& camera, Vec3d p_cam) {
  constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  return p_cam.z > 0 ? camera.project_point(p_cam) : Vec2d{kNone, kNone};
}

std::vector<Vec3d> unit_rays(const std::vector<Vec2d>& px, const Camera& camera) {
  std::vector<Vec3d> out;
  out.reserve(px.size());
  for (const Vec2d& p : px) {
    const Vec3d d = camera.pixel_ray(p.x, p.y);
    out.push_back((1 / norm(d)) * d);
  }
  return out;
}

std::optional<Cone> fit_cone(const std::vector<Vec3d>& rays, const Camera& camera) {
  const double f = focal(camera);
  std::vector<double> weights(rays.size(), 1.0), off(rays.size());
  Linear fit;
  double length = 0, sd = 0;
  for (int round = 0; round < kRounds; ++round) {
    fit = weighted_cone(rays, weights);
    length = fit.m.norm();
    if (!std::isfinite(length) || length <= 1 || fit.m[2] <= 0) return std::nullopt;
    // cos(a) = 1 / |m|, and d cos(a) = -sin(a) da.
    const double to_px = -f / std::sqrt(length * length - 1);
    for (std::size_t i = 0; i < rays.size(); ++i)
      off[i] = to_px * (rays[i].x * fit.m[0] + rays[i].y * fit.m[1] + rays[i].z * fit.m[2] - 1);
    sd = std::max(sd_by_median(off), kFloor_px);
    for (std::size_t i = 0; i < rays.size(); ++i) weights[i] = tukey_weight(off[i] / sd);
  }
  const double half = std::acos(1 / length);
  // Samples nearer than a pixel share pixels: at most as many edges as outline pixels count.
  const double counted = std::min(1.0, 2 * std::numbers::pi * f * half / double(rays.size()));
  const double sd_m = sd * std::sqrt(length * length - 1) / f;
  const Eigen::Matrix3d of_m = sd_m * sd_m / counted * optim::inverse_symmetric<3>(fit.A);
  const Vec3d axis{fit.m[0] / length, fit.m[1] / length, fit.m[2] / length};
  return Cone{axis, half, pixel_of(camera, axis), image_covariance(camera, fit.m, of_m)};
}

std::vector<double> residuals_px(const Cone& cone, const std::vector<Vec3d>& rays, const Camera& camera) {
  const double f = focal(camera);
  std::vector<double> out;
  out.reserve(rays.size());
  for (const Vec3d& d : rays)
    out.push_back(f * (std::acos(std::clamp(dot(d, cone.axis), -1.0, 1.0)) - cone.half_angle_rad));
  return out;
}

OutlineCurve outline_of(const Cone& cone, const Camera& camera, int count) {
  const Vec3d away = std::abs(cone.axis.x) < 0.9 ? Vec3d{1, 0, 0} : Vec3d{0, 1, 0};
  Vec3d side = cross(cone.axis, away);
  side = (1 / norm(side)) * side;
  const Vec3d other = cross(cone.axis, side);
  const auto n = std::size_t(count);
  OutlineCurve out;
  Vec2d centre{0, 0};
  for (int i = 0; i < count; ++i) {
    const double t = 2 * std::numbers::pi * i / count;
    const Vec3d around = std::cos(t) * side + std::sin(t) * other;
    const Vec3d ray = std::cos(cone.half_angle_rad) * cone.axis + std::sin(cone.half_angle_rad) * around;
    const Vec2d at = pixel_of(camera, ray);
    out.at.push_back(at);
    centre.x += at.x / count, centre.y += at.y / count;
  }
  for (std::size_t i = 0; i < n; ++i) {
    const Vec2d next = out.at[(i + 1) % n], last = out.at[(i + n - 1) % n];
    const Vec2d off{out.at[i].x - centre.x, out.at[i].y - centre.y};
    Vec2d normal{next.y - last.y, last.x - next.x};
    double length = hypotenuse(normal.x, normal.y);
    if (normal.x * off.x + normal.y * off.y < 0) length = -length;
    out.normal.push_back({normal.x / length, normal.y / length});
    out.radius_px += hypotenuse(off.x, off.y) / count;
  }
  return out;
}

}  // namespace sdftrack::calibration
