// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>

#include "primitives/solid_traits.h"
#include "sdf/solids.h"

namespace sdftrack::primitives {

template <>
struct SolidTraits<PrimitiveKind::kBox> : SolidDefaults {
  static constexpr const char* kName = "box";
  static constexpr SolidSize kSizes[] = {{"x", 0, true}, {"y", 1, true}, {"z", 2, true}};  // full edges
  static constexpr SolidAxis kAxes[3] = {{0, 0.5}, {1, 0.5}, {2, 0.5}};
  static constexpr int kUnknowns = 9;

  template <class T>
  static HD sdf::SolidSample<T> sample(Vec3<T> p, const T (&size)[sdf::kMaxSizes]) {
    return sdf::box_sample(p, size);
  }
  static Reach reach(Vec3d v, const PrimitiveSize& s) {
    const Vec3d side{std::copysign(0.5, v.x), std::copysign(0.5, v.y), std::copysign(0.5, v.z)};
    const Vec3d at{side.x * s[0], side.y * s[1], side.z * s[2]};
    return {dot(at, v), at, {side.x * v.x, side.y * v.y, side.z * v.z}};
  }
  static void guess(const SeedCloud& cloud, unsigned seed, std::vector<PrimitiveGuess>* out);
};

}  // namespace sdftrack::primitives
