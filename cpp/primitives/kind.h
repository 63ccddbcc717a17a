// SPDX-License-Identifier: MIT
// Shapes that are a formula: which there are, and what lengths each of them has. Centred at mid-height, axis
// along z, a cone's apex at +z; a plane patch has its normal along z.
#pragma once

#include <array>
#include <string>

#include "sdf/solid_sample.h"

namespace sdftrack::primitives {

enum class PrimitiveKind { kSphere, kCylinder, kCone, kBox, kEllipsoid, kPlane };
constexpr int kPrimitiveKinds = 6;

// How the lengths enter phi.
enum class Scaling {
  kExact,    // the exact distance to the solid of these lengths
  kPrinted,  // a unit solid under S = diag(s) (thesis Eq. 3.27), its field divided by |S^-1 grad| to first
             // order
};

using PrimitiveSize =
    std::array<double, sdf::kMaxSizes>;  // m; sphere: radius; cylinder, cone: radius, height; box:
                                         // edges; ellipsoid: radii; plane: width
                                         // along x, height along y. What a kind lacks is 1.

constexpr int size_count(PrimitiveKind kind) {
  switch (kind) {
    case PrimitiveKind::kSphere:
      return 1;
    case PrimitiveKind::kCylinder:
    case PrimitiveKind::kCone:
    case PrimitiveKind::kPlane:
      return 2;
    case PrimitiveKind::kBox:
    case PrimitiveKind::kEllipsoid:
      return 3;
  }
  return 0;
}

// Unknowns that a view can tell: a ball has no direction, a round body no turn about its axis.
constexpr int free_count(PrimitiveKind kind) {
  switch (kind) {
    case PrimitiveKind::kSphere:
      return 4;
    case PrimitiveKind::kCylinder:
    case PrimitiveKind::kCone:
      return 7;
    case PrimitiveKind::kPlane:
      return 8;
    case PrimitiveKind::kBox:
    case PrimitiveKind::kEllipsoid:
      return 9;
  }
  return 0;
}

constexpr bool is_round(PrimitiveKind kind) {
  return kind == PrimitiveKind::kCylinder || kind == PrimitiveKind::kCone;
}

// Whether the picture ends at edges. A surface that bends away from the camera ends in readings that are met
// at a grazing angle, and which a sensor loses.
constexpr bool has_edges(PrimitiveKind kind) {
  return kind != PrimitiveKind::kSphere && kind != PrimitiveKind::kEllipsoid;
}

// Lengths whose end may be out of sight while all that is seen fits: edges and heights, not radii.
constexpr bool has_ends(PrimitiveKind kind, int i) {
  return kind == PrimitiveKind::kBox || kind == PrimitiveKind::kPlane || (is_round(kind) && i == 1);
}
// The axis of the object's frame that such a length runs along.
constexpr int axis_of_size(PrimitiveKind kind, int i) { return is_round(kind) ? (i == 1 ? 2 : 0) : i; }

}  // namespace sdftrack::primitives
