// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>

#include "primitives/solid_traits.h"
#include "sdf/solids.h"

namespace sdftrack::primitives {

template <>
struct SolidTraits<PrimitiveKind::kCylinder> : SolidDefaults {
  static constexpr const char* kName = "cylinder";
  static constexpr SolidSize kSizes[] = {{"radius", 2, false}, {"height", 2, true}};
  static constexpr SolidAxis kAxes[3] = {{0, 1}, {0, 1}, {1, 0.5}};
  static constexpr int kUnknowns = 7;
  static constexpr bool kRound = true;

  template <class T>
  static HD sdf::SolidSample<T> sample(Vec3<T> p, const T (&size)[sdf::kMaxSizes]) {
    return sdf::cylinder_sample(p, size[0], size[1]);
  }
  static Reach reach(Vec3d v, const PrimitiveSize& s) {
    const double across = std::hypot(v.x, v.y), up = std::copysign(0.5, v.z);
    const Vec3d rim = rim_towards(v, across);
    return {s[0] * across + s[1] * up * v.z, s[0] * rim + Vec3d{0, 0, up * s[1]}, {across, up * v.z, 0}};
  }
  static void guess(const SeedCloud& cloud, unsigned seed, std::vector<PrimitiveGuess>* out);
};

}  // namespace sdftrack::primitives
