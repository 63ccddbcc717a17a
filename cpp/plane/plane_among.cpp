// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <vector>

#include "optim/dense.h"
#include "plane/plane.h"

namespace sdftrack::plane {

namespace {

double distance(const frame::Plane& plane, Vec3d p) { return dot(plane.normal_cam, p) + plane.offset_m; }

// Total least squares over the points within `reach` of the plane, with Tukey's weights.
bool refit(const std::vector<Vec3d>& points, double reach, frame::Plane* plane) {
  double total = 0;
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  Eigen::Matrix3d second = Eigen::Matrix3d::Zero();
  for (const Vec3d& p : points) {
    const double u = distance(*plane, p) / reach;
    if (std::abs(u) >= 1) continue;
    const double w = (1 - u * u) * (1 - u * u);
    const Eigen::Vector3d e(p.x, p.y, p.z);
    total += w, mean += w * e, second += w * e * e.transpose();
  }
  if (total < 3) return false;
  mean /= total;
  Eigen::Vector3d n = optim::eigenpairs<3>(second / total - mean * mean.transpose()).vectors.col(0);
  if (n.dot(mean) > 0) n = -n;  // towards the camera
  *plane = {{n.x(), n.y(), n.z()}, -n.dot(mean)};
  return true;
}

// Variance along the second longest axis of some points.
double middle_variance(const std::vector<Vec3d>& points) {
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  Eigen::Matrix3d second = Eigen::Matrix3d::Zero();
  for (const Vec3d& p : points) {
    const Eigen::Vector3d e(p.x, p.y, p.z);
    mean += e, second += e * e.transpose();
  }
  const auto n = double(std::max<std::size_t>(1, points.size()));
  mean /= n;
  const Eigen::Matrix3d covariance = second / n - mean * mean.transpose();
  return optim::eigenpairs<3>(covariance).values(1);
}

// The plane of three points about `apart_m` apart, found from a position in the list.
bool triple_plane(const std::vector<Vec3d>& points, int seed, double apart_m, frame::Plane* plane) {
  const auto n = double(points.size());
  const auto pick = [&](int k) { return points[std::size_t(std::fmod(0.5 + 0.7548776662 * k, 1.0) * n)]; };
  const Vec3d a = pick(seed);
  Vec3d b = a, normal{0, 0, 0};
  for (int k = 1; k <= 24; ++k) {
    const Vec3d p = pick(31 * seed + k);
    const double d = norm(p - a);
    if (d < 0.3 * apart_m || d > 1.2 * apart_m) continue;
    if (norm(b - a) == 0) {
      b = p;
      continue;
    }
    normal = cross(b - a, p - a);
    if (norm(normal) > 0.5 * norm(b - a) * d) break;
    normal = {0, 0, 0};
  }
  const double length = norm(normal);
  if (!(length > 0)) return false;
  normal = ((dot(normal, a) > 0 ? -1 : 1) / length) * normal;
  *plane = {normal, -dot(normal, a)};
  return true;
}

}  // namespace

std::optional<frame::Plane> plane_among(const std::vector<Vec3d>& points, double tolerance_m, int seeds,
                                        double min_share, double extent_m) {
  if (points.size() < 3) return std::nullopt;
  const auto count = [&](const frame::Plane& plane) {
    return std::count_if(points.begin(), points.end(),
                         [&](const Vec3d& p) { return on_plane(plane, p, tolerance_m); });
  };
  frame::Plane best{{0, 0, 0}, 0};
  std::ptrdiff_t most = 0;
  for (int k = 0; k < seeds; ++k) {
    frame::Plane plane;
    if (!triple_plane(points, k, extent_m, &plane)) continue;
    const std::ptrdiff_t votes = count(plane);
    if (votes > most) most = votes, best = plane;
  }
  if (most < 3) return std::nullopt;
  for (const double reach : {4.0, 3.0, 2.0})
    if (!refit(points, reach * tolerance_m, &best)) return std::nullopt;
  if (double(count(best)) < min_share * double(points.size())) return std::nullopt;
  // The width of a uniform strip is the square root of 12 times its standard deviation.
  std::vector<Vec3d> held;
  for (const Vec3d& p : points)
    if (on_plane(best, p, tolerance_m)) held.push_back(p);
  if (std::sqrt(12 * middle_variance(held)) < extent_m) return std::nullopt;
  return best;
}

}  // namespace sdftrack::plane
