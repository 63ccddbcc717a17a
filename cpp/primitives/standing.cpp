// SPDX-License-Identifier: MIT
#include "primitives/standing.h"

#include <algorithm>
#include <cmath>

#include "base/portable_math.h"

namespace sdftrack::primitives {

namespace {

constexpr double kLyingBelow = 0.7;  // cosine of 45 degrees

}  // namespace

bool may_stand(const PrimitiveField& field, const frame::Plane& plane) {
  return has_inside(field.kind) || std::abs(dot(field.T_obj_cam.R.r2, plane.normal_cam)) < kLyingBelow;
}

void standing_residual(const PrimitiveField& field, const PrimitiveSize& size, const frame::Plane& plane,
                       SolidResidual* out) {
  const Vec3d m = field.T_obj_cam.R * plane.normal_cam;
  const Reach reach = reach_of(field.kind, -m, size);
  out->m = plane.offset_m - dot(m, field.T_obj_cam.t) - reach.reach_m;
  const Vec3d turn = cross(m, reach.at);
  const double J[6] = {-m.x, -m.y, -m.z, turn.x, turn.y, turn.z};
  for (int j = 0; j < 6; ++j) out->J[j] = J[j];
  for (int i = 0; i < sdf::kMaxSizes; ++i)
    out->J[6 + i] = i < size_count(field.kind) ? -size[i] * reach.size[i] : 0.0;
}

int resting_residuals(const PrimitiveField& field, const PrimitiveSize& size, const frame::Plane& plane,
                      Rest rest, SolidResidual (&out)[3]) {
  const Vec3d m = field.T_obj_cam.R * plane.normal_cam;
  const double radius = size[0], half = 0.5 * size[1];
  const auto set = [&](int i, double value, const Vec3d& at) {
    SolidResidual& r = out[i];
    const Vec3d turn = cross(m, at);
    r.m = value;
    for (double& j : r.J) j = 0;
    r.J[3] = turn.x, r.J[4] = turn.y, r.J[5] = turn.z;
  };
  SolidResidual& gap = out[0];
  const double middle = plane.offset_m - dot(m, field.T_obj_cam.t);
  const auto set_gap = [&](const Vec3d& at) {
    set(0, middle + dot(m, at), at);
    gap.J[0] = -m.x, gap.J[1] = -m.y, gap.J[2] = -m.z;
  };
  if (rest == Rest::kSide) {
    const double across = std::max(1e-12, hypotenuse(m.x, m.y));
    set_gap({-radius * m.x / across, -radius * m.y / across, 0});
    gap.J[6] = -radius * across;
    set(1, m.z, {0, 0, 1});
    return 2;
  }
  const double down = has_apex(field.kind) ? -half : -std::copysign(half, m.z);
  set_gap({0, 0, down});
  gap.J[7] = down * m.z;
  set(1, m.x, {1, 0, 0});
  set(2, m.y, {0, 1, 0});
  return 3;
}

}  // namespace sdftrack::primitives
