// SPDX-License-Identifier: MIT
#include "tracking/plane.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <vector>

namespace sdftrack {

namespace {

constexpr int kPoints = 6000;  // readings that vote, on an even grid
constexpr int kFollowPoints = 1500;
constexpr int kFramesBetweenSearches = 30;
constexpr int kSeeds = 150;  // patches tried
constexpr int kLeastPoints = 100;
constexpr double kLeastShare = 0.1;  // of the readings

Vec3d point_at(const DepthFrame& frame, const Camera& camera, int x, int y) {
  const double z = frame.depth_m(x, y);
  if (!frame.rays) return z * ray(camera.K, static_cast<double>(x), static_cast<double>(y));
  const float* r = frame.rays + 2 * (static_cast<std::ptrdiff_t>(y) * camera.width + x);
  return {z * r[0], z * r[1], z};
}

bool left_out(const PlaneOptions& options, int x, int y) {
  for (const Rect& r : options.leave_out)
    if (x >= r.x0 && x < r.x1 && y >= r.y0 && y < r.y1) return true;
  return false;
}

std::vector<Vec3d> grid_points(const DepthFrame& frame, const Camera& camera, const PlaneOptions& options,
                               int wanted) {
  const double pixels = static_cast<double>(camera.width) * camera.height;
  const int step = std::max(1, static_cast<int>(std::sqrt(pixels / wanted)));
  std::vector<Vec3d> points;
  for (int y = step / 2; y < camera.height; y += step)
    for (int x = step / 2; x < camera.width; x += step)
      if (frame.depth_m(x, y) > 0 && !left_out(options, x, y))
        points.push_back(point_at(frame, camera, x, y));
  return points;
}

double distance(const Plane& plane, Vec3d p) { return dot(plane.normal_cam, p) + plane.offset_m; }

// Total least squares over the points within `reach` of the plane, Tukey's weights.
bool refit(const std::vector<Vec3d>& points, double reach, Plane* plane) {
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
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(second / total - mean * mean.transpose());
  Eigen::Vector3d n = solver.eigenvectors().col(0);
  if (n.dot(mean) > 0) n = -n;  // towards the camera
  *plane = {{n.x(), n.y(), n.z()}, -n.dot(mean)};
  return true;
}

// A plane through a 3-point patch about pixel (x, y), if its readings are there and not in one line.
bool patch_plane(const DepthFrame& frame, const Camera& camera, int x, int y, int r, Plane* plane) {
  if (x < r || y < r || x + r >= camera.width || y + r >= camera.height) return false;
  const int at[4][2] = {{x - r, y - r}, {x + r, y - r}, {x - r, y + r}, {x + r, y + r}};
  Vec3d p[4];
  for (int i = 0; i < 4; ++i) {
    if (!(frame.depth_m(at[i][0], at[i][1]) > 0)) return false;
    p[i] = point_at(frame, camera, at[i][0], at[i][1]);
  }
  Vec3d n = cross(p[3] - p[0], p[2] - p[1]);
  if (!(norm(n) > 1e-12)) return false;
  n = (1 / norm(n)) * n;
  const Vec3d mean = 0.25 * (p[0] + p[1] + p[2] + p[3]);
  *plane = {n, -dot(n, mean)};
  return true;
}

int votes(const std::vector<Vec3d>& points, const Plane& plane, double tolerance) {
  int count = 0;
  for (const Vec3d& p : points) count += std::abs(distance(plane, p)) < tolerance;
  return count;
}

}  // namespace

std::optional<Plane> find_plane(const DepthFrame& frame, const Camera& camera, const PlaneOptions& options) {
  const std::vector<Vec3d> points = grid_points(frame, camera, options, kPoints);
  const int r = std::max(3, camera.width / 40);
  Plane best{{0, 0, 0}, 0};
  int most = 0;
  const bool seeded = options.start_x >= 0;
  for (int i = 0; i < (seeded ? 1 : kSeeds); ++i) {
    // Additive recurrence: seeds that fill the image evenly, the same ones every time.
    const double a = std::fmod(0.5 + 0.7548776662 * i, 1.0), b = std::fmod(0.5 + 0.5698402910 * i, 1.0);
    const int x = seeded ? options.start_x : static_cast<int>(a * camera.width);
    const int y = seeded ? options.start_y : static_cast<int>(b * camera.height);
    Plane plane;
    if (left_out(options, x, y) || !patch_plane(frame, camera, x, y, r, &plane)) continue;
    for (int k = 0; k < 2; ++k)
      if (!refit(points, 3 * options.tolerance_m, &plane)) break;
    const int count = votes(points, plane, options.tolerance_m);
    if (count > most) most = count, best = plane;
  }
  if (most < std::max(static_cast<double>(kLeastPoints), kLeastShare * static_cast<double>(points.size())))
    return std::nullopt;
  for (int k = 0; k < 5; ++k) refit(points, options.tolerance_m, &best);
  return best;
}

namespace {

bool on_plane(const Plane& plane, Vec3d p, double tolerance_m) {
  return std::abs(distance(plane, p)) < plane_tolerance_m(tolerance_m, p.z);
}

// Variance along the second longest axis of some points.
double middle_variance(const std::vector<Vec3d>& points) {
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  Eigen::Matrix3d second = Eigen::Matrix3d::Zero();
  for (const Vec3d& p : points) {
    const Eigen::Vector3d e(p.x, p.y, p.z);
    mean += e, second += e * e.transpose();
  }
  const auto n = static_cast<double>(std::max<std::size_t>(1, points.size()));
  mean /= n;
  const Eigen::Matrix3d covariance = second / n - mean * mean.transpose();
  return Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(covariance).eigenvalues()(1);
}

// Three points that lie apart by about `apart_m`, found from a place in the list.
bool triple_plane(const std::vector<Vec3d>& points, int seed, double apart_m, Plane* plane) {
  const auto n = static_cast<double>(points.size());
  const auto pick = [&](int k) {
    return points[static_cast<std::size_t>(std::fmod(0.5 + 0.7548776662 * k, 1.0) * n)];
  };
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

std::optional<Plane> plane_among(const std::vector<Vec3d>& points, double tolerance_m, int seeds,
                                 double least_share, double extent_m) {
  if (points.size() < 3) return std::nullopt;
  const auto count = [&](const Plane& plane) {
    return std::count_if(points.begin(), points.end(),
                         [&](const Vec3d& p) { return on_plane(plane, p, tolerance_m); });
  };
  Plane best{{0, 0, 0}, 0};
  std::ptrdiff_t most = 0;
  for (int k = 0; k < seeds; ++k) {
    Plane plane;
    if (!triple_plane(points, k, extent_m, &plane)) continue;
    const std::ptrdiff_t votes = count(plane);
    if (votes > most) most = votes, best = plane;
  }
  if (most < 3) return std::nullopt;
  for (const double reach : {4.0, 3.0, 2.0})
    if (!refit(points, reach * tolerance_m, &best)) return std::nullopt;
  if (static_cast<double>(count(best)) < least_share * static_cast<double>(points.size()))
    return std::nullopt;
  // The width of a uniform strip is the square root of 12 times its standard deviation.
  std::vector<Vec3d> held;
  for (const Vec3d& p : points)
    if (on_plane(best, p, tolerance_m)) held.push_back(p);
  if (std::sqrt(12 * middle_variance(held)) < extent_m) return std::nullopt;
  return best;
}

void PlaneFollower::update(const DepthFrame& frame, const Camera& camera, const std::vector<Rect>& objects) {
  PlaneOptions options;
  options.leave_out = objects;
  if (plane_) {
    const std::vector<Vec3d> points = grid_points(frame, camera, options, kFollowPoints);
    bool holds = true;
    for (int k = 0; holds && k < 2; ++k) holds = refit(points, (2 - k) * options.tolerance_m, &*plane_);
    if (holds &&
        votes(points, *plane_, options.tolerance_m) > kLeastShare * static_cast<double>(points.size()))
      return;
    plane_.reset();
  }
  if (frames_to_search_-- > 0) return;
  plane_ = find_plane(frame, camera, options);
  frames_to_search_ = kFramesBetweenSearches;
}

}  // namespace sdftrack
