// SPDX-License-Identifier: MIT
// Plane patches: planes that hold many points, and rectangles around these points at several rotations.
#include <Eigen/Core>
#include <algorithm>
#include <cmath>

#include "optim/dense.h"
#include "primitives/seeds.h"

namespace sdftrack::primitives {

namespace {

constexpr int kPicked = 40;             // normals whose planes are tried
constexpr std::size_t kKeptPlanes = 3;  // of these
// In a quarter turn. The image's border may cut off corners, so the smallest rectangle may be wrong.
constexpr int kTurns = 12;
constexpr double kOnPlane = 0.02, kMinNear_m = 0.005;  // of the diameter: a point is on the plane
constexpr std::size_t kMinPoints = 8;

std::vector<Vec3d> near_plane(const SeedCloud& cloud, Vec3d n, Vec3d at) {
  const double tolerance = std::max(kMinNear_m, kOnPlane * cloud.diameter_m);
  std::vector<Vec3d> out;
  for (const Vec3d& p : cloud.points)
    if (std::abs(dot(n, p - at)) < tolerance) out.push_back(p);
  return out;
}

// The least-squares plane of points, its normal towards the camera.
Oriented plane_through(const std::vector<Vec3d>& points) {
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const Vec3d& p : points) mean += Eigen::Vector3d(p.x, p.y, p.z);
  mean /= double(points.size());
  Eigen::Matrix3d second = Eigen::Matrix3d::Zero();
  for (const Vec3d& p : points) {
    const Eigen::Vector3d d = Eigen::Vector3d(p.x, p.y, p.z) - mean;
    second += d * d.transpose();
  }
  Eigen::Vector3d n = optim::eigenpairs<3>(second).vectors.col(0);
  if (n.dot(mean) > 0) n = -n;
  return {{mean.x(), mean.y(), mean.z()}, {n.x(), n.y(), n.z()}};
}

PrimitiveGuess patch_guess(const std::vector<Vec3d>& points, const Oriented& plane, Vec3d x) {
  const Vec3d y = cross(plane.n, x);
  const Span u = span_along(points, x), v = span_along(points, y);
  const Vec3d middle =
      0.5 * (u.low + u.high) * x + 0.5 * (v.low + v.high) * y + dot(plane.p, plane.n) * plane.n;
  return {frame_at(x, y, plane.n, middle), {u.high - u.low, v.high - v.low, 1}};
}

}  // namespace

void SolidTraits<PrimitiveKind::kPlane>::guess(const SeedCloud& cloud, unsigned seed,
                                               std::vector<PrimitiveGuess>* out) {
  std::vector<std::vector<Vec3d>> held = {cloud.points};
  Picker pick(seed);
  for (int k = 0; k < kPicked && !cloud.normals.empty(); ++k) {
    const Oriented& o = cloud.normals[pick(cloud.normals.size())];
    held.push_back(near_plane(cloud, o.n, o.p));
  }
  std::stable_sort(held.begin() + 1, held.end(),
                   [](const auto& a, const auto& b) { return a.size() > b.size(); });
  if (held.size() > kKeptPlanes + 1) held.resize(kKeptPlanes + 1);
  for (const std::vector<Vec3d>& some : held) {
    if (some.size() < std::min(kMinPoints, cloud.points.size())) continue;
    const Oriented plane = plane_through(some);
    const std::vector<Vec3d> own = near_plane(cloud, plane.n, plane.p);
    if (own.size() < std::min(kMinPoints, cloud.points.size())) continue;
    Vec3d a, b;
    across(plane.n, &a, &b);
    for (int k = 0; k < kTurns; ++k) {
      const double angle = k * 3.14159265358979 / (2 * kTurns);
      out->push_back(patch_guess(own, plane, std::cos(angle) * a + std::sin(angle) * b));
    }
  }
}

}  // namespace sdftrack::primitives
