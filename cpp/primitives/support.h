// SPDX-License-Identifier: MIT
// How far a solid reaches in a direction: where it touches the table that it stands on.
#pragma once

#include <algorithm>
#include <cmath>

#include "base/vec.h"
#include "primitives/kind.h"

namespace sdftrack::primitives {

struct Reach {
  double reach_m;               // max of v . x over the solid
  Vec3d at;                     // a point where it is reached
  double size[sdf::kMaxSizes];  // d reach / d lengths
};

// `v`: unit length, object frame.
inline Reach reach_of(PrimitiveKind kind, Vec3d v, const PrimitiveSize& s) {
  const double across = std::hypot(v.x, v.y);
  const Vec3d rim = across > 1e-12 ? Vec3d{v.x / across, v.y / across, 0} : Vec3d{0, 0, 0};
  switch (kind) {
    case PrimitiveKind::kSphere:
      return {s[0], s[0] * v, {1, 0, 0}};
    case PrimitiveKind::kCylinder: {
      const double up = std::copysign(0.5, v.z);
      return {s[0] * across + s[1] * up * v.z, s[0] * rim + Vec3d{0, 0, up * s[1]}, {across, up * v.z, 0}};
    }
    case PrimitiveKind::kCone: {
      const double apex = 0.5 * v.z * s[1], base = s[0] * across - apex;
      if (apex > base) return {apex, {0, 0, 0.5 * s[1]}, {0, 0.5 * v.z, 0}};
      return {base, s[0] * rim - Vec3d{0, 0, 0.5 * s[1]}, {across, -0.5 * v.z, 0}};
    }
    case PrimitiveKind::kBox: {
      const Vec3d side{std::copysign(0.5, v.x), std::copysign(0.5, v.y), std::copysign(0.5, v.z)};
      const Vec3d at{side.x * s[0], side.y * s[1], side.z * s[2]};
      return {dot(at, v), at, {side.x * v.x, side.y * v.y, side.z * v.z}};
    }
    case PrimitiveKind::kPlane: {
      const Vec3d at{std::copysign(0.5, v.x) * s[0], std::copysign(0.5, v.y) * s[1], 0};
      return {dot(at, v), at, {0.5 * std::abs(v.x), 0.5 * std::abs(v.y), 0}};
    }
    case PrimitiveKind::kEllipsoid:
      break;
  }
  const Vec3d w{s[0] * v.x, s[1] * v.y, s[2] * v.z};
  const double reach = std::max(1e-12, norm(w));
  return {reach,
          {s[0] * w.x / reach, s[1] * w.y / reach, s[2] * w.z / reach},
          {w.x * v.x / reach, w.y * v.y / reach, w.z * v.z / reach}};
}

}  // namespace sdftrack::primitives
