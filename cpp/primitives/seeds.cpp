// SPDX-License-Identifier: MIT
#include "primitives/seeds.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "base/portable_math.h"
#include "optim/dense.h"

namespace sdftrack::primitives {

namespace {

constexpr std::size_t kNormalPoints = 1500;  // points that normals are computed from
constexpr std::size_t kNormals = 160;
constexpr std::size_t kMinHeld = 60;
constexpr std::size_t kFewPoints = 300;  // with this many points or fewer, normals are not used
constexpr std::size_t kMinNormals = 12;
constexpr std::size_t kSpanPoints = 400;
constexpr double kReach = 0.07;  // of the diameter: radius of a neighbourhood
constexpr double kMinReach_m = 0.006;
constexpr int kMinNeighbours = 6;

Eigen::Vector3d eigen(Vec3d p) { return {p.x, p.y, p.z}; }
Vec3d vec(const Eigen::Vector3d& p) { return {p.x(), p.y(), p.z()}; }

// The normal of the points within `reach` of p; false where they are too few or not on a surface.
bool normal_at(const std::vector<Vec3d>& points, Vec3d p, double reach, Vec3d* n) {
  double sum[3] = {}, second[6] = {};
  int count = 0;
  for (const Vec3d& q : points) {
    const Vec3d d = q - p;
    if (dot(d, d) > reach * reach) continue;
    ++count;
    sum[0] += d.x, sum[1] += d.y, sum[2] += d.z;
    second[0] += d.x * d.x, second[1] += d.x * d.y, second[2] += d.x * d.z;
    second[3] += d.y * d.y, second[4] += d.y * d.z, second[5] += d.z * d.z;
  }
  if (count < kMinNeighbours) return false;
  Eigen::Matrix3d M;
  M << second[0], second[1], second[2], second[1], second[3], second[4], second[2], second[4], second[5];
  const Eigen::Vector3d s(sum[0], sum[1], sum[2]);
  M = M / count - s * s.transpose() / (double(count) * count);
  Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver;
  solver.computeDirect(M);
  if (!(solver.eigenvalues()[1] > 2 * solver.eigenvalues()[0])) return false;
  *n = vec(solver.eigenvectors().col(0));
  return true;
}

}  // namespace

Span span_along(const std::vector<Vec3d>& points, Vec3d direction) {
  std::vector<double> at;
  const std::size_t n = std::min(points.size(), kSpanPoints);
  for (std::size_t i = 0; i < n; ++i) at.push_back(dot(points[i], direction));
  const auto out = std::ptrdiff_t(n / 100);
  std::nth_element(at.begin(), at.begin() + out, at.end());
  const double low = at[out];
  std::nth_element(at.begin(), at.end() - 1 - out, at.end());
  return {low, at[n - 1 - std::size_t(out)]};
}

void across(Vec3d axis, Vec3d* u, Vec3d* v) {
  const Vec3d other = std::abs(axis.x) < 0.7 ? Vec3d{1, 0, 0} : Vec3d{0, 1, 0};
  *u = cross(axis, other);
  *u = (1 / norm(*u)) * *u;
  *v = cross(axis, *u);
}

Rigidd frame_at(Vec3d x, Vec3d y, Vec3d z, Vec3d origin) {
  const Mat3d R{x, y, z};
  return {R, -(R * origin)};
}

bool meeting_point(const std::vector<Oriented>& normals, Vec3d* centre) {
  std::vector<double> weight(normals.size(), 1.0);
  for (int round = 0; round < 4; ++round) {
    Eigen::Matrix3d A = Eigen::Matrix3d::Zero();
    Eigen::Vector3d b = Eigen::Vector3d::Zero();
    for (std::size_t i = 0; i < normals.size(); ++i) {
      const Eigen::Vector3d n = eigen(normals[i].n);
      const Eigen::Matrix3d M = weight[i] * (Eigen::Matrix3d::Identity() - n * n.transpose());
      A += M, b += M * eigen(normals[i].p);
    }
    const optim::Eigenpairs<3> pairs = optim::eigenpairs<3>(A);
    if (!(pairs.values[0] > 0.01 * pairs.values[2])) return false;
    const Eigen::Vector3d c =
        pairs.vectors * (pairs.values.cwiseInverse().asDiagonal() * (pairs.vectors.transpose() * b));
    *centre = vec(c);
    for (std::size_t i = 0; i < normals.size(); ++i) {
      const Vec3d d = *centre - normals[i].p, off = d - dot(d, normals[i].n) * normals[i].n;
      const double miss = norm(off) / std::max(1e-6, 0.2 * norm(d));
      weight[i] = 1 / (1 + miss * miss);
    }
  }
  return true;
}

SeedCloud seed_cloud(const PrimitiveView& view) {
  SeedCloud cloud{{}, {}, {}, {0, 0, 0}, 0, &view, false};
  const std::size_t n = std::min(view.points.size(), kNormalPoints);
  cloud.points.assign(view.points.begin(), view.points.begin() + std::ptrdiff_t(n));
  for (const Vec3d& p : cloud.points) cloud.mean = cloud.mean + (1.0 / double(n)) * p;
  for (const Vec3d& axis : {Vec3d{1, 0, 0}, Vec3d{0, 1, 0}, Vec3d{0, 0, 1}}) {
    const Span s = span_along(cloud.points, axis);
    cloud.diameter_m = hypotenuse(cloud.diameter_m, s.high - s.low);
  }
  const double reach = std::max(kMinReach_m, kReach * cloud.diameter_m);
  for (std::size_t i = 0; i < std::min(n, 2 * kNormals) && cloud.normals.size() < kNormals; ++i) {
    Oriented o{cloud.points[i], {0, 0, 1}};
    if (!normal_at(cloud.points, o.p, reach, &o.n)) continue;
    const double out = view.along_rays ? -dot(o.n, o.p) : dot(o.n, o.p - cloud.mean);
    if (out < 0) o.n = -o.n;
    cloud.normals.push_back(o);
  }
  for (const Oriented& o : cloud.normals) cloud.held.push_back(o.p);
  if (cloud.held.size() < kMinHeld) cloud.held = cloud.points;
  cloud.sparse = n <= kFewPoints || cloud.normals.size() < kMinNormals;
  return cloud;
}

std::vector<PrimitiveGuess> guesses(PrimitiveKind kind, const SeedCloud& cloud, unsigned seed) {
  std::vector<PrimitiveGuess> out;
  visit_solid(kind, [&](auto solid) { solid.guess(cloud, seed, &out); });
  const double least = std::max(1e-4, 0.02 * cloud.diameter_m), most = 5 * cloud.diameter_m + 1e-3;
  for (PrimitiveGuess& guess : out)
    for (int i = 0; i < size_count(kind); ++i)
      if (is_length(kind, i)) guess.size[i] = std::clamp(guess.size[i], least, most);
  return out;
}

}  // namespace sdftrack::primitives
