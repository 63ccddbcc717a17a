// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>

#include "primitives/solid_traits.h"
#include "sdf/solids.h"

namespace sdftrack::primitives {

template <>
struct SolidTraits<PrimitiveKind::kCone> : SolidDefaults {
  static constexpr const char* kName = "cone";
  static constexpr SolidSize kSizes[] = {{"radius", 2, false}, {"height", 2, true}};
  static constexpr SolidAxis kAxes[3] = {{0, 1}, {0, 1}, {1, 0.5}};
  static constexpr int kUnknowns = 7;
  static constexpr bool kRound = true, kApex = true;

  template <class T>
  static HD sdf::SolidSample<T> sample(Vec3<T> p, const T (&size)[sdf::kMaxSizes]) {
    return sdf::cone_sample(p, size[0], size[1]);
  }
  static Reach reach(Vec3d v, const PrimitiveSize& s) {
    const double across = std::hypot(v.x, v.y), apex = 0.5 * v.z * s[1], base = s[0] * across - apex;
    if (apex > base) return {apex, {0, 0, 0.5 * s[1]}, {0, 0.5 * v.z, 0}};
    return {base, s[0] * rim_towards(v, across) - Vec3d{0, 0, 0.5 * s[1]}, {across, -0.5 * v.z, 0}};
  }
  static void guess(const SeedCloud& cloud, unsigned seed, std::vector<PrimitiveGuess>* out);
};

}  // namespace sdftrack::primitives
