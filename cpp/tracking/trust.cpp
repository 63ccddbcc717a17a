// SPDX-License-Identifier: MIT
#include "tracking/trust.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace sdftrack {

namespace {

constexpr double kFacing = 0.25;        // cosine of the incidence below which a point is not asked
constexpr double kTolerance_m = 0.004;  // least distance that counts as disagreement
constexpr double kTolerancePerNoise = 4;
constexpr double kMisfit = 0.5;  // share of the cost of readings that do not fit at all
constexpr double kFarPose_m = 0.020, kFarPose_rad = 10 * std::numbers::pi / 180;

// Whether the object itself hides p from the camera: march towards the camera through the field.
bool self_hidden(const Shape& shape, Vec3f p, Vec3f normal, Vec3f to_camera) {
  const float voxel = shape.sdf.voxel_m, leave = static_cast<float>(shape.diameter_m);
  const Vec3f start = p + 1.5f * voxel * normal;
  float t = voxel;
  for (int k = 0; k < 24 && t < leave; ++k) {
    float phi;
    Vec3f g;
    sample(shape.sdf, start + t * to_camera, &phi, &g);
    if (phi < 0.1f * voxel) return true;
    t += std::max(phi, voxel);
  }
  return false;
}

std::string percent(double share) {
  return std::to_string(static_cast<int>(std::lround(100 * share))) + " %";
}

double ratio(int part, int whole) { return whole > 0 ? static_cast<double>(part) / whole : 0.0; }

double rise(double x) { return 1 / (1 + std::exp(-x)); }

}  // namespace

Visibility compare_visible_surface(const DepthFrame& frame, const Camera& camera, const Shape& shape,
                                   const Rigidd& T_cam_obj, double noise_m, int points) {
  Visibility seen;
  const Vec3d eye = inverse(T_cam_obj).t;
  const double tolerance = std::max(kTolerance_m, kTolerancePerNoise * noise_m);
  const std::size_t n = shape.points.size();
  const std::size_t stride = std::max<std::size_t>(1, n / static_cast<std::size_t>(std::max(1, points)));
  for (std::size_t i = 0; i < n; i += stride) {
    const Vec3d p = shape.points[i].cast<double>(), normal = shape.normals[i].cast<double>();
    const Vec3d d = eye - p;
    const Vec3d to_camera = (1 / norm(d)) * d;
    const double facing = dot(normal, to_camera);
    if (facing < kFacing || self_hidden(shape, shape.points[i], shape.normals[i], to_camera.cast<float>()))
      continue;
    ++seen.expected;
    const Vec3d p_cam = T_cam_obj * p;
    const Vec2d u = p_cam.z > 1e-3 ? camera.project_point(p_cam) : Vec2d{-1, -1};
    const int x = static_cast<int>(std::lround(std::clamp(u.x, -1.0, 1e6)));
    const int y = static_cast<int>(std::lround(std::clamp(u.y, -1.0, 1e6)));
    const bool inside = x >= 0 && y >= 0 && x < camera.width && y < camera.height;
    const float z = inside ? frame.depth_m(x, y) : 0.0f;
    const double beyond = (static_cast<double>(z) - p_cam.z) * facing;  // about along the normal
    if (!(z > 0))
      ++seen.missing;
    else if (beyond > tolerance)
      ++seen.farther;
    else if (beyond < -tolerance)
      ++seen.nearer;
    else
      ++seen.agree;
  }
  return seen;
}

Trust judge(const Visibility& seen, double mean_cost, const Matrix6d& covariance,
            const TrackerOptions& options) {
  Trust trust;
  trust.inliers = ratio(seen.agree, seen.expected);
  const double unhidden = ratio(seen.agree, seen.agree + seen.farther);
  const double read = ratio(seen.agree, seen.agree + seen.farther + seen.nearer);
  const int enough = 6;  // points; fewer say nothing
  if (seen.agree < enough || unhidden < options.lost_inliers || read < 0.05) {
    trust.status = Status::kLost;
    trust.reason =
        "only " + percent(read) + " of the surface that the camera should see is where the pose puts it";
  } else if (unhidden < options.weak_inliers || read < 0.25) {
    trust.status = Status::kWeak;
    trust.reason =
        seen.nearer > seen.farther
            ? percent(ratio(seen.nearer, seen.expected)) + " of the object is hidden"
            : "the camera sees past " + percent(1 - unhidden) + " of the surface that it should see";
  }
  const double misfit = options.outlier_floor > 0 ? mean_cost / -std::log(options.outlier_floor) : 0;
  if (trust.status == Status::kOk && misfit > kMisfit) {
    trust.status = Status::kWeak;
    trust.reason = "most readings near the pose do not fit the shape";
  }
  if (trust.status == Status::kLost) return trust;
  // Evidence that this is the object at this pose, times the chance that the error left is small.
  const double evidence =
      rise((std::min(unhidden, 2 * read) - 0.45) / 0.06) * rise((kMisfit - misfit) / 0.03);
  const double var_m = covariance.diagonal().head<3>().maxCoeff();
  const double var_rad = covariance.diagonal().tail<3>().maxCoeff();
  const double near_m = std::erf(kFarPose_m / std::sqrt(2 * var_m));
  const double near_rad = std::erf(kFarPose_rad / std::sqrt(2 * var_rad));
  trust.confidence = evidence * near_m * near_rad;
  return trust;
}

}  // namespace sdftrack
