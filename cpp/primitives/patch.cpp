// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>

#include "primitives/residuals.h"
#include "primitives/solids.h"

namespace sdftrack::primitives {

namespace {

constexpr double kTouching_m = 1e-9;  // nearer than this, p - q has no direction
// A stretch that ends behind the patch certainly passes through it, since its end includes a margin. The
// slope is finite because a cost must not jump.
constexpr double kSteep = 20;

// A stretch of a ray, object frame.
struct Stretch {
  Vec3d from, way;

  Vec3d at(double s) const { return from + s * way; }
};

// A side of the rectangle: its middle, its direction (unit length), half its length.
struct Side {
  Vec3d middle, along;
  double half_m;
};

// The nearest points of a ray and the patch: p on the ray, q on the patch.
struct Nearest {
  Vec3d p, q;
  double m;
};

bool holds(const PrimitiveField& field, Vec3d p) {
  return std::abs(p.x) <= 0.5 * field.size_m[0] && std::abs(p.y) <= 0.5 * field.size_m[1];
}

Nearest nearest(const Stretch& ray, const Side& side) {
  const Vec3d r = ray.from - side.middle;
  const double a = dot(ray.way, ray.way), b = dot(ray.way, side.along);
  const double on_ray = dot(ray.way, r), on_side = dot(side.along, r);
  const double apart = a - b * b;  // 0: parallel
  double s = apart > 1e-12 * a ? std::clamp((b * on_side - on_ray) / apart, 0.0, 1.0) : 0.0;
  const double t = std::clamp(b * s + on_side, -side.half_m, side.half_m);
  s = std::clamp((b * t - on_ray) / a, 0.0, 1.0);
  const Vec3d p = ray.at(s), q = side.middle + t * side.along;
  return {p, q, norm(p - q)};
}

// Perpendicular to the ray and the side, outwards: the direction of p - q in the limit where they meet.
Vec3d outwards(const Stretch& ray, Vec3d q, const PrimitiveField& field) {
  const bool x_side = std::abs(q.x) / field.size_m[0] >= std::abs(q.y) / field.size_m[1];
  const Vec3d along = x_side ? Vec3d{0, 1, 0} : Vec3d{1, 0, 0};
  Vec3d n = cross(ray.way, along);
  n = (1 / std::max(1e-300, norm(n))) * n;
  return (x_side ? n.x * q.x : n.y * q.y) < 0 ? -n : n;
}

}  // namespace

using Patch = SolidTraits<PrimitiveKind::kPlane>;

bool Patch::ray_residual(const PrimitiveField& field, Vec3d p_cam, double grazing, SolidResidual* out) {
  const Vec3d ray = field.T_obj_cam.R * ((1 / p_cam.z) * p_cam);
  if (std::abs(ray.z) < grazing) return false;
  const Vec3d p = field.T_obj_cam * p_cam;
  out->m = -p.z / ray.z;
  const Vec3d hit = p + out->m * ray;
  if (!holds(field, hit)) return false;
  const double factor = -1 / ray.z;
  const double J[PrimitiveField::P] = {0, 0, factor, factor * hit.y, -factor * hit.x};
  std::copy(J, J + PrimitiveField::P, out->J);
  return true;
}

void Patch::clearance(const PrimitiveField& field, const OutlineRay& ray, SolidResidual* out) {
  const Vec3d from = field.T_obj_cam * (ray.near_m * ray.ray), to = field.T_obj_cam * (ray.far_m * ray.ray);
  const Stretch stretch{from, to - from};
  const double half_x = 0.5 * field.size_m[0], half_y = 0.5 * field.size_m[1];
  const Side sides[4] = {{{half_x, 0, 0}, {0, 1, 0}, half_y},
                         {{-half_x, 0, 0}, {0, 1, 0}, half_y},
                         {{0, half_y, 0}, {1, 0, 0}, half_x},
                         {{0, -half_y, 0}, {1, 0, 0}, half_x}};
  Nearest best = nearest(stretch, sides[0]);
  for (int i = 1; i < 4; ++i) {
    const Nearest other = nearest(stretch, sides[i]);
    if (other.m < best.m) best = other;
  }
  const bool crosses = from.z * to.z < 0;
  const bool through = crosses && holds(field, stretch.at(from.z / (from.z - to.z)));
  if (!crosses)
    for (const Vec3d& end : {from, to})  // the stretch ends before the patch
      if (holds(field, end) && std::abs(end.z) < best.m) best = {end, {end.x, end.y, 0}, std::abs(end.z)};
  out->m = through ? -best.m : best.m;
  Vec3d n = best.m > kTouching_m ? (1 / out->m) * (best.p - best.q) : outwards(stretch, best.q, field);
  if (through)
    for (const Vec3d& end : {from, to})
      if (kSteep * std::abs(end.z) < -out->m) {
        out->m = -kSteep * std::abs(end.z);
        best.p = end, best.q = {0, 0, 0}, n = {0, 0, end.z > 0 ? -kSteep : kSteep};
      }
  const Vec3d turn = cross(best.p, n);
  // q moves with the side on which it lies; n has no component along a side.
  const double J[PrimitiveField::P] = {
      n.x, n.y, n.z, turn.x, turn.y, turn.z, -n.x * best.q.x, -n.y * best.q.y};
  std::copy(J, J + PrimitiveField::P, out->J);
}

}  // namespace sdftrack::primitives
