// SPDX-License-Identifier: MIT
#pragma once

#include "primitives/ellipsoid_ray.h"
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
  template <class T>
  static HD RayMeeting<T> meet(const Vec3<T>& from, const Vec3<T>& way, const T (&size)[sdf::kMaxSizes]) {
    const T radii[sdf::kMaxSizes] = {size[0], size[0], size[0]};
    RayMeeting<T> out = meet_ellipsoid(
        from, way, radii, [&](const Vec3<T>& p) __attribute__((always_inline)) {
          return sdf::sphere_sample(p, size[0]);
        });
    out.at.s.size[0] = T(-1);
    return out;
  }
  template <class T>
  static HD RayClearance<T> least_along(const Vec3<T>& origin, const Vec3<T>& way, T a, T b,
                                        const T (&size)[sdf::kMaxSizes]) {
    const T nearest = -dot(origin, way) / dot(way, way);
    const T depth = select(nearest < a, a, select(nearest > b, b, nearest));
    const Vec3<T> p = origin + depth * way;
    const RayPlace<T> here{p, sdf::sphere_sample(p, size[0])};
    return {here.s.phi_m, T(1), here, here};
  }
  static Reach reach(Vec3d v, const PrimitiveSize& s) { return {s[0], s[0] * v, {1, 0, 0}}; }
  static void guess(const SeedCloud& cloud, unsigned seed, std::vector<PrimitiveGuess>* out);
};

}  // namespace sdftrack::primitives
