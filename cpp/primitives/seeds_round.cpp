// SPDX-License-Identifier: MIT
// Cylinders and cones: the direction of the axis, its position, and the radius along it.
#include <Eigen/Core>
#include <algorithm>
#include <cmath>

#include "base/portable_math.h"
#include "optim/dense.h"
#include "primitives/seeds.h"

namespace sdftrack::primitives {

namespace {

constexpr int kRoundPairs = 24;
constexpr int kTriples = 24;
constexpr double kCap = 0.9, kFlatCap = 0.97;  // cosines of 26 and 14 degrees: normals of a cone's base

struct Ring {  // a measurement of the side: height along the axis, distance from it
  double z, r;
};

// Possible directions of the axis.
std::vector<Vec3d> axes_of(PrimitiveKind kind, const SeedCloud& cloud, unsigned seed) {
  std::vector<Vec3d> axes;
  if (cloud.view->has_plane) axes.push_back(cloud.view->plane.normal_cam);
  const auto& normals = cloud.normals;
  if (normals.size() < 3) return axes;
  Picker pick(seed);
  const auto add = [&](Vec3d a, double least) {
    const double length = norm(a);
    if (length > least) axes.push_back((1 / length) * a);
  };
  // The normals of a cylinder's side are perpendicular to its axis: two of them give it.
  for (int k = 0; k < kRoundPairs; ++k)
    add(cross(normals[pick(normals.size())].n, normals[pick(normals.size())].n), 0.3);
  // The normals of a cone's side have one angle to the axis: differences of three are perpendicular to it.
  if (has_apex(kind))
    for (int k = 0; k < kTriples; ++k) {
      const Vec3d a = normals[pick(normals.size())].n, b = normals[pick(normals.size())].n,
                  c = normals[pick(normals.size())].n;
      add(cross(a - b, a - c), 0.05);
    }
  // The normal of a cap, and the direction of least spread of all normals.
  for (int k = 0; k < 6; ++k) axes.push_back(normals[pick(normals.size())].n);
  Eigen::Matrix3d second = Eigen::Matrix3d::Zero();
  for (const Oriented& o : normals) {
    const Eigen::Vector3d n(o.n.x, o.n.y, o.n.z);
    second += n * n.transpose();
  }
  const Eigen::Matrix3d v = optim::eigenpairs<3>(second).vectors;
  for (int k = 0; k < 3; k += 2) axes.push_back({v(0, k), v(1, k), v(2, k)});
  return axes;
}

// The normals of the side, without those of a cap. If most lie between 14 and 26 degrees from the axis, they
// are the side of a flat cone; fewer may be noise of its base.
std::vector<Oriented> sides_of(PrimitiveKind kind, const std::vector<Oriented>& normals, Vec3d axis) {
  double most = has_apex(kind) ? kCap : 0.35;
  if (has_apex(kind)) {
    std::size_t nearly_level = 0;
    for (const Oriented& o : normals) {
      const double cosine = std::abs(dot(o.n, axis));
      nearly_level += cosine >= kCap && cosine < kFlatCap;
    }
    if (2 * nearly_level > normals.size()) most = kFlatCap;
  }
  std::vector<Oriented> sides;
  for (const Oriented& o : normals)
    if (std::abs(dot(o.n, axis)) < most) sides.push_back(o);
  return sides;
}

// The axis' position: projected along it, a round body's normals meet in it. Robust; caps are left out.
bool middle_of(const std::vector<Oriented>& sides, Vec3d u, Vec3d v, Vec2d* middle) {
  std::vector<double> weight(sides.size(), 1.0);
  for (int round = 0; round < 3; ++round) {
    double axx = 0, axy = 0, ayy = 0, bx = 0, by = 0;
    for (std::size_t i = 0; i < sides.size(); ++i) {
      double nx = dot(sides[i].n, u), ny = dot(sides[i].n, v);
      const double length = hypotenuse(nx, ny);
      nx /= length, ny /= length;
      const double off = -ny * dot(sides[i].p, u) + nx * dot(sides[i].p, v), w = weight[i];
      axx += w * ny * ny, axy -= w * nx * ny, ayy += w * nx * nx;
      bx -= w * ny * off, by += w * nx * off;
    }
    const double det = axx * ayy - axy * axy, trace = axx + ayy;
    if (!(det > 1e-3 * trace * trace)) return false;
    *middle = {(ayy * bx - axy * by) / det, (axx * by - axy * bx) / det};
    for (std::size_t i = 0; i < sides.size(); ++i) {
      const double dx = middle->x - dot(sides[i].p, u), dy = middle->y - dot(sides[i].p, v);
      const double nx = dot(sides[i].n, u), ny = dot(sides[i].n, v);
      const double miss =
          std::abs(nx * dy - ny * dx) / (0.2 * hypotenuse(nx, ny) * hypotenuse(dx, dy) + 1e-9);
      weight[i] = 1 / (1 + miss * miss);
    }
  }
  return true;
}

double quantile(std::vector<double> x, double share) {
  const auto at = std::ptrdiff_t(share * double(x.size() - 1));
  std::nth_element(x.begin(), x.begin() + at, x.end());
  return x[at];
}

// Robust fit of r = r0 - k z to the side's measurements; k: the taper.
void taper(const std::vector<Ring>& rings, double* r0, double* k) {
  std::vector<double> weight(rings.size(), 1.0);
  for (int round = 0; round < 4; ++round) {
    double w = 0, sz = 0, sr = 0, szz = 0, szr = 0;
    for (std::size_t i = 0; i < rings.size(); ++i) {
      const Ring& g = rings[i];
      w += weight[i], sz += weight[i] * g.z, sr += weight[i] * g.r;
      szz += weight[i] * g.z * g.z, szr += weight[i] * g.z * g.r;
    }
    const double spread = szz / w - sz * sz / (w * w);
    *k = spread > 1e-12 ? -(szr / w - sz * sr / (w * w)) / spread : 0.0;
    *r0 = sr / w + *k * sz / w;
    for (std::size_t i = 0; i < rings.size(); ++i) {
      const double miss = (rings[i].r - *r0 + *k * rings[i].z) / 0.004;
      weight[i] = 1 / (1 + miss * miss);
    }
  }
}

void add_cylinder(Vec3d axis, Vec3d u, Vec3d v, Vec2d middle, const std::vector<Ring>& rings, Span span,
                  std::vector<PrimitiveGuess>* out) {
  std::vector<double> r;
  for (const Ring& g : rings) r.push_back(g.r);
  const double z = 0.5 * (span.low + span.high);
  const Vec3d centre = middle.x * u + middle.y * v + z * axis;
  out->push_back({frame_at(u, v, axis, centre), {quantile(r, 0.5), span.high - span.low, 1}});
}

void add_cone(Vec3d axis, Vec3d u, Vec3d v, Vec2d middle, const std::vector<Ring>& rings, Span span,
              std::vector<PrimitiveGuess>* out) {
  double r0, k;
  taper(rings, &r0, &k);
  if (k < 0) k = -k, axis = -axis, v = -v, middle.y = -middle.y, span = {-span.high, -span.low};
  k = std::clamp(k, 0.02, 20.0);
  const double apex = std::clamp(r0 / k, span.high, span.high + 3 * (span.high - span.low));
  const double height = apex - span.low;
  const Vec3d centre = middle.x * u + middle.y * v + (span.low + 0.5 * height) * axis;
  out->push_back({frame_at(u, v, axis, centre), {k * height, height, 1}});
}

void guess_round(PrimitiveKind kind, const SeedCloud& cloud, unsigned seed,
                 std::vector<PrimitiveGuess>* out) {
  for (const Vec3d& axis : axes_of(kind, cloud, seed)) {
    Vec3d u, v;
    across(axis, &u, &v);
    const std::vector<Oriented> sides = sides_of(kind, cloud.normals, axis);
    const Span x = span_along(cloud.held, u), y = span_along(cloud.held, v);
    Span z = span_along(cloud.held, axis);
    if (cloud.view->stands && std::abs(dot(axis, cloud.view->plane.normal_cam)) > 0.95) {
      const bool up = dot(axis, cloud.view->plane.normal_cam) > 0;
      const double table = -cloud.view->plane.offset_m;  // p . normal there
      if (up)
        z.low = std::min(z.low, table);
      else
        z.high = std::max(z.high, -table);
    }
    Vec2d middle{0.5 * (x.low + x.high), 0.5 * (y.low + y.high)};
    const bool round = sides.size() >= 8 && middle_of(sides, u, v, &middle);
    std::vector<Ring> rings;
    for (const Oriented& o : sides)
      rings.push_back({dot(o.p, axis), hypotenuse(dot(o.p, u) - middle.x, dot(o.p, v) - middle.y)});
    if (!round || rings.empty()) {
      // No visible side: a disc as wide as the points, with a height behind it.
      const double r = 0.25 * (x.high - x.low + y.high - y.low);
      middle = {0.5 * (x.low + x.high), 0.5 * (y.low + y.high)};
      if (z.high - z.low < r) (dot(axis, cloud.mean) > 0 ? z.high = z.low + r : z.low = z.high - r);
      const bool base_near = dot(axis, cloud.mean) > 0;  // of a cone: its apex is out of sight
      rings = {{z.low, r}, {z.high, r}};
      if (has_apex(kind)) rings[base_near ? 1 : 0].r = 0;
    }
    if (has_apex(kind))
      add_cone(axis, u, v, middle, rings, z, out);
    else
      add_cylinder(axis, u, v, middle, rings, z, out);
  }
}

void guess_all_round(PrimitiveKind kind, const SeedCloud& cloud, unsigned seed,
                     std::vector<PrimitiveGuess>* out) {
  guess_round(kind, cloud, seed, out);
  if (cloud.sparse) guess_round_of_few(kind, cloud, out);
}

}  // namespace

void SolidTraits<PrimitiveKind::kCylinder>::guess(const SeedCloud& cloud, unsigned seed,
                                                  std::vector<PrimitiveGuess>* out) {
  guess_all_round(PrimitiveKind::kCylinder, cloud, seed, out);
}
void SolidTraits<PrimitiveKind::kCone>::guess(const SeedCloud& cloud, unsigned seed,
                                              std::vector<PrimitiveGuess>* out) {
  guess_all_round(PrimitiveKind::kCone, cloud, seed, out);
}

}  // namespace sdftrack::primitives
