// SPDX-License-Identifier: MIT
// All kinds of primitives: SolidTraits of each, their properties by kind, and the dispatch.
#pragma once

#include <algorithm>
#include <cmath>
#include <iterator>
#include <span>
#include <utility>

#include "base/portable_math.h"
#include "primitives/ellipsoid_ray.h"
#include "primitives/solid_traits.h"
#include "sdf/solid_ellipsoid.h"
#include "sdf/solid_superquadric.h"
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
    const double across = hypotenuse(v.x, v.y), apex = 0.5 * v.z * s[1], base = s[0] * across - apex;
    if (apex > base) return {apex, {0, 0, 0.5 * s[1]}, {0, 0.5 * v.z, 0}};
    return {base, s[0] * rim_towards(v, across) - Vec3d{0, 0, 0.5 * s[1]}, {across, -0.5 * v.z, 0}};
  }
  static void guess(const SeedCloud& cloud, unsigned seed, std::vector<PrimitiveGuess>* out);
};

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
    const double across = hypotenuse(v.x, v.y), up = std::copysign(0.5, v.z);
    const Vec3d rim = rim_towards(v, across);
    return {s[0] * across + s[1] * up * v.z, s[0] * rim + Vec3d{0, 0, up * s[1]}, {across, up * v.z, 0}};
  }
  static void guess(const SeedCloud& cloud, unsigned seed, std::vector<PrimitiveGuess>* out);
};

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
  static HD sdf::SolidSample<T> unit_sample(Vec3<T> p, const T (&)[sdf::kMaxSizes]) {
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

// A plane patch: a rectangle. Rays meet it in closed form, because its phi has no inside that an iteration
// could cross (docs/math/primitives.md, section 8).

struct OutlineRay;
struct PrimitiveField;
struct SolidResidual;

template <>
struct SolidTraits<PrimitiveKind::kPlane> : SolidDefaults {
  static constexpr const char* kName = "plane";
  static constexpr SolidSize kSizes[] = {{"width", 0, true}, {"height", 1, true}};  // along x and y
  static constexpr SolidAxis kAxes[3] = {{0, 0.5}, {1, 0.5}, {-1, 0}};
  static constexpr int kUnknowns = 8;
  static constexpr bool kInside = false, kInAuto = false;

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

// Convex: its exponents are at most 2. Not compared with the other kinds, of which it contains most.
template <>
struct SolidTraits<PrimitiveKind::kSuperquadric> : SolidDefaults {
  static constexpr const char* kName = "superquadric";
  static constexpr SolidSize kSizes[] = {
      {"rx", 0, true}, {"ry", 1, true}, {"rz", 2, true}, {"e1", -1, false}, {"e2", -1, false}};
  static constexpr SolidAxis kAxes[3] = {{0, 1}, {1, 1}, {2, 1}};
  static constexpr int kUnknowns = 11;
  static constexpr bool kEdges = false, kInAuto = false;

  template <class T>
  static HD sdf::SolidSample<T, sdf::kMaxSizes> sample(Vec3<T> p, const T (&size)[sdf::kMaxSizes]) {
    return sdf::superquadric_sample(p, size);
  }
  // The printed form scales a solid of the same exponents.
  template <class T>
  static HD sdf::SolidSample<T, sdf::kMaxSizes> unit_sample(Vec3<T> p, const T (&size)[sdf::kMaxSizes]) {
    const T unit[sdf::kMaxSizes] = {T(1), T(1), T(1), size[3], size[4]};
    return sdf::superquadric_sample(p, unit);
  }
  // The dual norm: half axes 1 / a and exponents 2 - e.
  static Reach reach(Vec3d v, const PrimitiveSize& s) {
    constexpr double kSharp = 1e-3;  // an exponent of 2 has the dual 0, a maximum
    const sdf::SuperquadricNorm<double> h = sdf::superquadric_norm<double>(
        {std::abs(v.x), std::abs(v.y), std::abs(v.z)}, {1 / s[0], 1 / s[1], 1 / s[2]},
        std::max(kSharp, 2 - s[3]), std::max(kSharp, 2 - s[4]));
    return {h.value,
            {std::copysign(h.grad.x, v.x), std::copysign(h.grad.y, v.y), std::copysign(h.grad.z, v.z)},
            {h.value * h.share[0] / s[0], h.value * h.share[1] / s[1], h.value * h.share[2] / s[2],
             -h.value * h.log_by_e[0], -h.value * h.log_by_e[1]}};
  }
  static void guess(const SeedCloud& cloud, unsigned seed, std::vector<PrimitiveGuess>* out);
};

// The constants of SolidTraits<kind> as values.
struct SolidFacts {
  const char* name;
  std::span<const SolidSize> sizes;
  std::span<const SolidAxis, 3> axes;
  int unknowns;
  bool round, apex, edges, inside, in_auto;
};

template <PrimitiveKind kKind>
constexpr SolidFacts facts_of() {
  using S = SolidTraits<kKind>;
  static_assert(std::size(S::kSizes) <= sdf::kMaxSizes);
  return {S::kName, S::kSizes, S::kAxes,   S::kUnknowns, S::kRound,
          S::kApex, S::kEdges, S::kInside, S::kInAuto};
}

template <int... k>
constexpr std::array<SolidFacts, kPrimitiveKinds> facts_of_all(std::integer_sequence<int, k...>) {
  return {facts_of<static_cast<PrimitiveKind>(k)>()...};
}

inline constexpr std::array<SolidFacts, kPrimitiveKinds> kSolidFacts =
    facts_of_all(std::make_integer_sequence<int, kPrimitiveKinds>{});

constexpr const SolidFacts& facts(PrimitiveKind kind) { return kSolidFacts[std::size_t(kind)]; }

constexpr int size_count(PrimitiveKind kind) { return int(facts(kind).sizes.size()); }
constexpr int free_count(PrimitiveKind kind) { return facts(kind).unknowns; }
constexpr bool is_round(PrimitiveKind kind) { return facts(kind).round; }
constexpr bool has_apex(PrimitiveKind kind) { return facts(kind).apex; }
constexpr bool has_edges(PrimitiveKind kind) { return facts(kind).edges; }
constexpr bool has_inside(PrimitiveKind kind) { return facts(kind).inside; }
constexpr const SolidSize& size_of(PrimitiveKind kind, int i) { return facts(kind).sizes[i]; }
constexpr bool is_length(PrimitiveKind kind, int i) { return size_of(kind, i).axis >= 0; }

// Returns visit(SolidTraits<kind>{}).
template <int k = 0, class Visit>
HD auto visit_solid(PrimitiveKind kind, const Visit& visit) {
  if constexpr (k + 1 < kPrimitiveKinds)
    if (kind != static_cast<PrimitiveKind>(k)) return visit_solid<k + 1>(kind, visit);
  return visit(SolidTraits<static_cast<PrimitiveKind>(k)>{});
}

// A sample of any kind: derivatives by sizes that the kind lacks are 0.
template <class T>
using AnySample = sdf::SolidSample<T, sdf::kMaxSizes>;

template <class T, int N>
HD AnySample<T> any_sample(const sdf::SolidSample<T, N>& s) {
  AnySample<T> out{s.phi_m, s.grad, {}};
  for (int i = 0; i < N; ++i) out.size[i] = s.size[i];
  return out;
}

template <class T>
HD AnySample<T> exact_sample(PrimitiveKind kind, Vec3<T> p, const T (&size)[sdf::kMaxSizes]) {
  return visit_solid(
      kind, [&](auto solid) __attribute__((always_inline)) { return any_sample(solid.sample(p, size)); });
}

inline Reach reach_of(PrimitiveKind kind, Vec3d v, const PrimitiveSize& s) {
  return visit_solid(kind, [&](auto solid) { return solid.reach(v, s); });
}

}  // namespace sdftrack::primitives
