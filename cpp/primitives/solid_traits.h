// SPDX-License-Identifier: MIT
// What a kind of primitive is to the rest: the members of SolidTraits<kind>, each in a header of its own.
#pragma once

#include <vector>

#include "base/vec.h"
#include "primitives/kind.h"

namespace sdftrack::primitives {

struct PrimitiveGuess;
struct SeedCloud;

// One of the lengths.
struct SolidSize {
  const char* name;
  int axis;      // of the object's frame: where the length is in doubt, the middle is in doubt along it
  bool has_end;  // whether its end may be out of sight while all that is seen fits: edges, heights; not radii
};

// One of the axes x, y, z: which length runs along it (-1: none), and how much of it lies on either side.
struct SolidAxis {
  int size;
  double half;
};

// How far a solid reaches in a direction: where it touches the table that it stands on.
struct Reach {
  double reach_m;               // max of v . x over the solid
  Vec3d at;                     // a point where it is reached
  double size[sdf::kMaxSizes];  // d reach / d lengths
};

// The point of a unit circle across z that is farthest towards `v`; `across`: v's part there.
inline Vec3d rim_towards(Vec3d v, double across) {
  return across > 1e-12 ? Vec3d{v.x / across, v.y / across, 0} : Vec3d{0, 0, 0};
}

// What most kinds are.
struct SolidDefaults {
  // Bodies of revolution about z, with a radius and a height, that stand on a base.
  static constexpr bool kRound = false;
  // Of a round one: whether its other end is an apex, and no base.
  static constexpr bool kApex = false;
  // Whether the picture ends at edges. A surface that bends away from the camera ends in readings that are
  // met at a grazing angle, and which a sensor loses.
  static constexpr bool kEdges = true;
  // Whether phi is negative somewhere; without, there is no volume to track.
  static constexpr bool kInside = true;
};

// Beside the members of SolidDefaults:
//   kName, kSizes (SolidSize each), kAxes (SolidAxis of x, y and z)
//   kUnknowns             those that a view can tell: a ball has no direction, a round body no turn about its
//                         axis
//   sample(p, size)       exact phi with derivatives, p in the object's frame; T: double, lanes or Dual
//   reach(v, size)        v of unit length, object frame
//   guess(cloud, seed, guesses)
// and where the kind has them
//   unit_sample(p)        of what the printed form scales, if that is not the solid whose lengths are 1
//   ray_residual, clearance   as in residuals.h, where phi does not lead a ray to the surface
template <PrimitiveKind kKind>
struct SolidTraits;

}  // namespace sdftrack::primitives
