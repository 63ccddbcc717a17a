// SPDX-License-Identifier: MIT
// Boxes: three orthogonal directions that most normals follow, and the extent of the points along them.
#include <Eigen/LU>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>

#include "optim/dense.h"
#include "primitives/seeds.h"

namespace sdftrack::primitives {

namespace {

constexpr int kFrames = 60;  // frames that are tried
constexpr std::size_t kKept = 8;

struct Frame3 {
  Vec3d x, y, z;
  double score;
};

Frame3 frame_of(Vec3d z, Vec3d towards) {
  Vec3d x = towards - dot(towards, z) * z;
  x = (1 / norm(x)) * x;
  return {x, cross(z, x), z, 0};
}

// The number of normals within about 10 degrees of an axis.
double follow(const std::vector<Oriented>& normals, const Frame3& f) {
  double sum = 0;
  for (const Oriented& o : normals) {
    const double c = std::max({std::abs(dot(o.n, f.x)), std::abs(dot(o.n, f.y)), std::abs(dot(o.n, f.z))});
    sum += std::exp(-(1 - c) / 0.008);
  }
  return sum;
}

// Means of the normals near each axis, made orthogonal again: the initial pair of normals was noisy.
Frame3 refined(const std::vector<Oriented>& normals, const Frame3& f) {
  Eigen::Matrix3d M = Eigen::Matrix3d::Zero();
  const Vec3d axes[3] = {f.x, f.y, f.z};
  for (int k = 0; k < 3; ++k) {
    Vec3d sum = 0.5 * axes[k];
    for (const Oriented& o : normals) {
      const double c = dot(o.n, axes[k]);
      if (std::abs(c) > 0.95) sum = sum + std::copysign(1.0, c) * o.n;
    }
    M.col(k) = Eigen::Vector3d(sum.x, sum.y, sum.z);
  }
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(M, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const Eigen::Matrix3d R = svd.matrixU() * svd.matrixV().transpose();
  if (R.determinant() < 0) return f;
  const auto column = [&](int i) { return Vec3d{R(0, i), R(1, i), R(2, i)}; };
  return {column(0), column(1), column(2), 0};
}

}  // namespace

PrimitiveGuess box_around(const SeedCloud& cloud, Vec3d x, Vec3d y, Vec3d z) {
  const Vec3d axes[3] = {x, y, z};
  PrimitiveGuess g;
  double middle[3];
  for (int k = 0; k < 3; ++k) {
    Span s = span_along(cloud.held, axes[k]);
    if (cloud.view->stands) {
      const double up = dot(axes[k], cloud.view->plane.normal_cam), table = -cloud.view->plane.offset_m;
      if (up > 0.95) s.low = std::min(s.low, table);
      if (up < -0.95) s.high = std::max(s.high, -table);
    }
    g.size[k] = s.high - s.low;
    middle[k] = 0.5 * (s.low + s.high);
  }
  // A single visible face does not show the thickness of the box: it starts at an arbitrary one.
  const double thick = 0.25 * std::max({g.size[0], g.size[1], g.size[2]});
  for (int k = 0; k < 3; ++k) {
    double& length = g.size[k];
    if (length >= 0.3 * thick) continue;
    const double away = dot(axes[k], cloud.mean) > 0 ? 1 : -1;
    middle[k] += away * 0.5 * (thick - length);
    length = thick;
  }
  g.T_obj_cam = frame_at(x, y, z, middle[0] * x + middle[1] * y + middle[2] * z);
  return g;
}

void guess_boxes(const SeedCloud& cloud, unsigned seed, std::vector<PrimitiveGuess>* out) {
  std::vector<Frame3> frames;
  const auto& normals = cloud.normals;
  Picker pick(seed);
  const auto consider = [&](Vec3d z, Vec3d towards) {
    if (std::abs(dot(z, towards)) < 0.5) frames.push_back(frame_of(z, towards));
  };
  for (int k = 0; k < kFrames && normals.size() >= 2; ++k)
    consider(normals[pick(normals.size())].n, normals[pick(normals.size())].n);
  if (cloud.view->has_plane)
    for (int k = 0; k < kFrames / 3 && !normals.empty(); ++k)
      consider(cloud.view->plane.normal_cam, normals[pick(normals.size())].n);
  for (Frame3& f : frames) f.score = follow(normals, f);
  std::stable_sort(frames.begin(), frames.end(),
                   [](const Frame3& a, const Frame3& b) { return a.score > b.score; });
  if (frames.size() > kKept) frames.resize(kKept);
  for (Frame3& f : frames) f = refined(normals, f);
  // Boxes along the principal axes of the points, and turned in their plane for a single visible face.
  Eigen::Matrix3d second = Eigen::Matrix3d::Zero();
  for (const Vec3d& p : cloud.points) {
    const Eigen::Vector3d d(p.x - cloud.mean.x, p.y - cloud.mean.y, p.z - cloud.mean.z);
    second += d * d.transpose();
  }
  const Eigen::Matrix3d v = optim::eigenpairs<3>(second).vectors;
  const auto column = [&](int i) { return Vec3d{v(0, i), v(1, i), v(2, i)}; };
  std::vector<Vec3d> tops = {column(0)};
  if (cloud.view->has_plane) tops.push_back(cloud.view->plane.normal_cam);
  for (const Vec3d& top : tops) {
    Vec3d a, b;
    across(top, &a, &b);
    Frame3 best{a, b, top, 1e30};
    for (int k = 0; k < 12; ++k) {  // for the smallest rectangle around them
      const double angle = k * 3.14159265358979 / 24;
      const Vec3d x = std::cos(angle) * a + std::sin(angle) * b, y = cross(top, x);
      const Span sx = span_along(cloud.held, x), sy = span_along(cloud.held, y);
      const double area = (sx.high - sx.low) * (sy.high - sy.low);
      if (area < best.score) best = {x, y, top, area};
    }
    frames.push_back(best);
  }
  frames.push_back(frame_of(column(0), column(2)));
  for (const Frame3& f : frames) out->push_back(box_around(cloud, f.x, f.y, f.z));
}

void SolidTraits<PrimitiveKind::kBox>::guess(const SeedCloud& cloud, unsigned seed,
                                             std::vector<PrimitiveGuess>* out) {
  guess_boxes(cloud, seed, out);
  if (cloud.sparse) guess_boxes_of_few(cloud, seed, out);
}

}  // namespace sdftrack::primitives
