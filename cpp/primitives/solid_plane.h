// SPDX-License-Identifier: MIT
// A plane patch: a rectangle. Rays meet it in closed form, because its phi has no inside that an iteration
// could cross (docs/math/primitives.md, section 8).
#pragma once

#include <cmath>

#include "primitives/solid_traits.h"
#include "sdf/patch.h"

namespace sdftrack::primitives {

struct OutlineRay;
struct PrimitiveField;
struct SolidResidual;

template <>
struct SolidTraits<PrimitiveKind::kPlane> : SolidDefaults {
  static constexpr const char* kName = "plane";
  static constexpr SolidSize kSizes[] = {{"width", 0, true}, {"height", 1, true}};  // along x and y
  static constexpr SolidAxis kAxes[3] = {{0, 0.5}, {1, 0.5}, {-1, 0}};
  static constexpr int kUnknowns = 8;
  static constexpr bool kInside = false;

  template <class T>
  static HD sdf::SolidSample<T> sample(Vec3<T> p, const T (&size)[sdf::kMaxSizes]) {
    return sdf::patch_sample(p, size);
  }
  static Reach reach(Vec3d v, const PrimitiveSize& s) {
    const Vec3d at{std::copysign(0.5, v.x) * s[0], std::copysign(0.5, v.y) * s[1], 0};
    return {dot(at, v), at, {0.5 * std::abs(v.x), 0.5 * std::abs(v.y), 0}};
  }
  static void guess(const SeedCloud& cloud, unsigned seed, std::vector<PrimitiveGuess>* out);

  // The distance along the measurement's ray to the patch, for measurements in front of it and behind it.
  // False where the ray misses the patch or meets it at a flatter angle than the cosine `grazing`.
  static bool ray_residual(const PrimitiveField& field, Vec3d p_cam, double grazing, SolidResidual* out);

  // The least phi along the ray. Where the ray passes through the patch: minus the distance from the rim,
  // which falls to 0 steeply where the stretch ends in the patch.
  static void clearance(const PrimitiveField& field, const OutlineRay& ray, SolidResidual* out);
};

}  // namespace sdftrack::primitives
