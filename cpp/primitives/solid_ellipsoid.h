// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>

#include "primitives/ellipsoid_ray.h"
#include "primitives/solid_traits.h"
#include "sdf/solid_ellipsoid.h"
#include "sdf/solids.h"

namespace sdftrack::primitives {

template <>
struct SolidTraits<PrimitiveKind::kEllipsoid> : SolidDefaults {
  static constexpr const char* kName = "ellipsoid";
  static constexpr SolidSize kSizes[] = {{"rx", 0, false}, {"ry", 1, false}, {"rz", 2, false}};  // radii
  static constexpr SolidAxis kAxes[3] = {{0, 1}, {1, 1}, {2, 1}};
  static constexpr int kUnknowns = 9;
  static constexpr bool kEdges = false;

  template <class T>
  static HD sdf::SolidSample<T> sample(Vec3<T> p, const T (&size)[sdf::kMaxSizes]) {
    return sdf::ellipsoid_sample(p, size);
  }
  template <class T>
  static HD RayMeeting<T> meet(const Vec3<T>& from, const Vec3<T>& way, const T (&size)[sdf::kMaxSizes]) {
    return meet_ellipsoid(
        from, way, size, [&](const Vec3<T>& p) __attribute__((always_inline)) {
          return sdf::ellipsoid_sample(p, size);
        });
  }
  template <class T>
  static HD RayClearance<T> least_along(const Vec3<T>& origin, const Vec3<T>& way, T a, T b,
                                        const T (&size)[sdf::kMaxSizes]) {
    return least_along_ellipsoid(origin, way, a, b, size);
  }
  // The unit solid is a ball, which is scaled.
  template <class T>
  static HD sdf::SolidSample<T> unit_sample(Vec3<T> p) {
    return sdf::sphere_sample(p, T(1));
  }
  static Reach reach(Vec3d v, const PrimitiveSize& s) {
    const Vec3d w{s[0] * v.x, s[1] * v.y, s[2] * v.z};
    const double reach = std::max(1e-12, norm(w));
    return {reach,
            {s[0] * w.x / reach, s[1] * w.y / reach, s[2] * w.z / reach},
            {w.x * v.x / reach, w.y * v.y / reach, w.z * v.z / reach}};
  }
  static void guess(const SeedCloud& cloud, unsigned seed, std::vector<PrimitiveGuess>* out);
};

}  // namespace sdftrack::primitives
