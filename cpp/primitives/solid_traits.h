// SPDX-License-Identifier: MIT
// The kinds of primitives, and what each defines: the members of SolidTraits<kind> (solids.h).
#pragma once

#include <array>

#include "base/vec.h"
#include "sdf/solid_sample.h"

namespace sdftrack::primitives {

// The kinds of shapes that are given by a formula. Centred at mid-height, axis along z, a cone's apex at +z;
// a plane patch has its normal along z. A new kind needs a name here and its SolidTraits in solids.h.
enum class PrimitiveKind { kSphere, kCylinder, kCone, kBox, kEllipsoid, kPlane, kSuperquadric, kEnd };
constexpr int kPrimitiveKinds = int(PrimitiveKind::kEnd);

// How the lengths enter phi.
enum class Scaling {
  kExact,    // the exact distance to the solid of these lengths
  kPrinted,  // a unit solid under S = diag(s) (thesis Eq. 3.27): its field at S^-1 p, at the measured points
};

using PrimitiveSize =
    std::array<double, sdf::kMaxSizes>;  // m, exponents without unit; sizes that a kind lacks are 1

struct PrimitiveGuess;
struct SeedCloud;

// One length, or exponent, of a solid.
struct SolidSize {
  const char* name;
  int axis;  // of the object frame: an uncertain length leaves the centre uncertain along it; -1: an exponent
  bool has_end;  // whether an unseen end leaves the length open: edges, heights; not radii
};

// One of the axes x, y, z: the length along it (-1: none), and the share of that length on either side.
struct SolidAxis {
  int size;
  double half;
};

// How far a solid reaches in a direction: gives the point where it touches the table that it stands on.
struct Reach {
  double reach_m;               // max of v . x over the solid
  Vec3d at;                     // a point where it is reached
  double size[sdf::kMaxSizes];  // d reach / d sizes
};

// The point of the unit circle in the xy plane that is farthest towards `v`; `across`: v's length there.
inline Vec3d rim_towards(Vec3d v, double across) {
  return across > 1e-12 ? Vec3d{v.x / across, v.y / across, 0} : Vec3d{0, 0, 0};
}

// The defaults, true for most kinds.
struct SolidDefaults {
  // Bodies of revolution about z, with a radius and a height, that stand on a base.
  static constexpr bool kRound = false;
  // For a round body: whether its other end is an apex instead of a base.
  static constexpr bool kApex = false;
  // Whether the silhouette ends at edges. A surface that curves away from the camera ends in measurements at
  // a grazing angle, which a sensor loses.
  static constexpr bool kEdges = true;
  // Whether phi is negative somewhere; otherwise there is no volume to track.
  static constexpr bool kInside = true;
  // Whether the kinds that are compared for an object of unknown kind contain it.
  static constexpr bool kInAuto = true;
};

// In addition to the members of SolidDefaults:
//   kName, kSizes (SolidSize each, lengths first), kAxes (SolidAxis of x, y and z)
//   kUnknowns             unknowns that a view can show: a ball has no direction, a round body no rotation
//   about its
//                         axis
//   sample(p, size)       exact phi with derivatives, p in the object's frame; T: double, lanes or Dual
//   reach(v, size)        v of unit length, object frame
//   guess(cloud, seed, guesses)
// and, for some kinds,
//   unit_sample(p, size)  of the solid that the printed form scales, if not the one with lengths 1
//   ray_residual, clearance   as in residuals.h, where phi does not lead a ray to the surface
template <PrimitiveKind kKind>
struct SolidTraits;

}  // namespace sdftrack::primitives
