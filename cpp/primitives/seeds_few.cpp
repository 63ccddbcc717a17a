// SPDX-License-Identifier: MIT
// Guesses from points too few, or too far apart, for normals: directions spread over the sphere, and a solid
// from the points seen along each. The cost selects among them; for a hundred points it is cheap.
#include <Eigen/Core>
#include <algorithm>
#include <cmath>

#include "base/portable_math.h"
#include "optim/dense.h"
#include "primitives/seeds.h"

namespace sdftrack::primitives {

namespace {

constexpr int kAxes = 160;       // on half a ball: 11 degrees apart
constexpr int kFewFrames = 300;  // of a box: the nearest one is within 8 degrees
constexpr double kGoldenAngle = 2.39996322972865;
constexpr double kNear = 0.15;  // of the radius: a point farther from the circle is on a cap
constexpr int kRounds = 4;

struct Flat {  // a point projected along the axis, and its position on the axis
  double x, y, z;
};

// Robust fit of a circle to points projected along the axis; points of the caps lie inside. False if none.
bool circle_through(const std::vector<Flat>& points, Vec2d* middle, double* radius) {
  std::vector<double> weight(points.size(), 1.0);
  for (int round = 0; round < kRounds; ++round) {
    Eigen::Matrix3d A = Eigen::Matrix3d::Zero();
    Eigen::Vector3d b = Eigen::Vector3d::Zero();
    for (std::size_t i = 0; i < points.size(); ++i) {
      const Flat& p = points[i];
      const Eigen::Vector3d row(2 * p.x, 2 * p.y, 1);
      A += weight[i] * row * row.transpose(), b += weight[i] * (p.x * p.x + p.y * p.y) * row;
    }
    const Eigen::Vector3d c = optim::solve_symmetric<3, 1>(A, b);
    const double r2 = c[2] + c[0] * c[0] + c[1] * c[1];
    if (!c.allFinite() || !(r2 > 0)) return false;
    *middle = {c[0], c[1]}, *radius = std::sqrt(r2);
    for (std::size_t i = 0; i < points.size(); ++i) {
      const double off = (hypotenuse(points[i].x - c[0], points[i].y - c[1]) - *radius) / (kNear * *radius);
      weight[i] = 1 / (1 + off * off);
    }
  }
  return true;
}

struct Round {  // the circle seen along an axis
  Vec3d axis, u, v;
  double low, high;
};

void add_round(PrimitiveKind kind, const Round& r, Vec2d middle, double radius,
               std::vector<PrimitiveGuess>* out) {
  const double height = r.high - r.low;
  const Vec3d centre = middle.x * r.u + middle.y * r.v + 0.5 * (r.low + r.high) * r.axis;
  out->push_back({frame_at(r.u, r.v, r.axis, centre), {radius, height, 1}});
  if (has_apex(kind))  // try the apex at either end
    out->push_back({frame_at(r.u, -r.v, -r.axis, centre), {radius, height, 1}});
}

}  // namespace

void guess_round_of_few(PrimitiveKind kind, const SeedCloud& cloud, std::vector<PrimitiveGuess>* out) {
  std::vector<Flat> flat(cloud.points.size());
  for (int k = 0; k < kAxes; ++k) {
    const double up = (k + 0.5) / kAxes, across_m = std::sqrt(1 - up * up), turn = kGoldenAngle * k;
    Round r{{across_m * std::cos(turn), across_m * std::sin(turn), up}, {}, {}, 0, 0};
    across(r.axis, &r.u, &r.v);
    // Relative to the mean: the points may lie far from the frame's origin.
    const Vec2d mean{dot(cloud.mean, r.u), dot(cloud.mean, r.v)};
    for (std::size_t i = 0; i < flat.size(); ++i) {
      const Vec3d& p = cloud.points[i];
      flat[i] = {dot(p, r.u) - mean.x, dot(p, r.v) - mean.y, dot(p, r.axis)};
    }
    const Span x = span_along(cloud.points, r.u), y = span_along(cloud.points, r.v),
               z = span_along(cloud.points, r.axis);
    r.low = z.low, r.high = z.high;
    const double widest = 0.5 * std::max(x.high - x.low, y.high - y.low);
    add_round(kind, r, {0.5 * (x.low + x.high), 0.5 * (y.low + y.high)}, widest, out);
    Vec2d middle;
    double radius;
    if (!circle_through(flat, &middle, &radius)) continue;
    middle = {middle.x + mean.x, middle.y + mean.y};
    add_round(kind, r, middle, has_apex(kind) ? 1.5 * radius : radius, out);
  }
}

void guess_boxes_of_few(const SeedCloud& cloud, unsigned seed, std::vector<PrimitiveGuess>* out) {
  Picker pick(seed + 1);
  constexpr std::size_t kSteps = 1 << 20;
  const auto uniform = [&] { return (double(pick(kSteps)) + 0.5) / kSteps; };
  for (int k = 0; k < kFewFrames; ++k) {
    // A uniformly random frame: an axis anywhere on the sphere, and a rotation about it.
    const double up = 2 * uniform() - 1, around = 6.283185307179586 * uniform();
    const double turn = 1.5707963267948966 * uniform(), flat = std::sqrt(1 - up * up);
    const Vec3d z{flat * std::cos(around), flat * std::sin(around), up};
    Vec3d u, v;
    across(z, &u, &v);
    const Vec3d x = std::cos(turn) * u + std::sin(turn) * v;
    out->push_back(box_around(cloud, x, cross(z, x), z));
  }
}

}  // namespace sdftrack::primitives
