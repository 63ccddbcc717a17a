// SPDX-License-Identifier: MIT
#pragma once

#include "primitives/solid_traits.h"
#include "sdf/solids.h"

namespace sdftrack::primitives {

template <>
struct SolidTraits<PrimitiveKind::kSphere> : SolidDefaults {
  static constexpr const char* kName = "sphere";
  static constexpr SolidSize kSizes[] = {{"radius", 2, false}};
  static constexpr SolidAxis kAxes[3] = {{0, 1}, {0, 1}, {0, 1}};
  static constexpr int kUnknowns = 4;
  static constexpr bool kEdges = false;

  template <class T>
  static HD sdf::SolidSample<T> sample(Vec3<T> p, const T (&size)[sdf::kMaxSizes]) {
    return sdf::sphere_sample(p, size[0]);
  }
  static Reach reach(Vec3d v, const PrimitiveSize& s) { return {s[0], s[0] * v, {1, 0, 0}}; }
  static void guess(const SeedCloud& cloud, unsigned seed, std::vector<PrimitiveGuess>* out);
};

}  // namespace sdftrack::primitives
