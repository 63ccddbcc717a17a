// SPDX-License-Identifier: MIT
// All kinds of primitives: their properties by kind, and the dispatch to their functions.
#pragma once

#include <iterator>
#include <span>
#include <utility>

#include "primitives/solid_box.h"
#include "primitives/solid_cone.h"
#include "primitives/solid_cylinder.h"
#include "primitives/solid_ellipsoid.h"
#include "primitives/solid_plane.h"
#include "primitives/solid_sphere.h"

namespace sdftrack::primitives {

// The constants of SolidTraits<kind> as values.
struct SolidFacts {
  const char* name;
  std::span<const SolidSize> sizes;
  std::span<const SolidAxis, 3> axes;
  int unknowns;
  bool round, apex, edges, inside;
};

template <PrimitiveKind kKind>
constexpr SolidFacts facts_of() {
  using S = SolidTraits<kKind>;
  static_assert(std::size(S::kSizes) <= sdf::kMaxSizes);
  return {S::kName, S::kSizes, S::kAxes, S::kUnknowns, S::kRound, S::kApex, S::kEdges, S::kInside};
}

template <int... k>
constexpr std::array<SolidFacts, kPrimitiveKinds> facts_of_all(std::integer_sequence<int, k...>) {
  return {facts_of<static_cast<PrimitiveKind>(k)>()...};
}

inline constexpr std::array<SolidFacts, kPrimitiveKinds> kSolidFacts =
    facts_of_all(std::make_integer_sequence<int, kPrimitiveKinds>{});

constexpr const SolidFacts& facts(PrimitiveKind kind) { return kSolidFacts[static_cast<std::size_t>(kind)]; }

constexpr int size_count(PrimitiveKind kind) { return static_cast<int>(facts(kind).sizes.size()); }
constexpr int free_count(PrimitiveKind kind) { return facts(kind).unknowns; }
constexpr bool is_round(PrimitiveKind kind) { return facts(kind).round; }
constexpr bool has_apex(PrimitiveKind kind) { return facts(kind).apex; }
constexpr bool has_edges(PrimitiveKind kind) { return facts(kind).edges; }
constexpr bool has_inside(PrimitiveKind kind) { return facts(kind).inside; }
constexpr const SolidSize& size_of(PrimitiveKind kind, int i) {
  return facts(kind).sizes[static_cast<std::size_t>(i)];
}

// Returns visit(SolidTraits<kind>{}).
template <int k = 0, class Visit>
HD auto visit_solid(PrimitiveKind kind, const Visit& visit) {
  if constexpr (k + 1 < kPrimitiveKinds)
    if (kind != static_cast<PrimitiveKind>(k)) return visit_solid<k + 1>(kind, visit);
  return visit(SolidTraits<static_cast<PrimitiveKind>(k)>{});
}

template <class T>
HD sdf::SolidSample<T> exact_sample(PrimitiveKind kind, Vec3<T> p, const T (&size)[sdf::kMaxSizes]) {
  return visit_solid(
      kind, [&](auto solid) __attribute__((always_inline)) { return solid.sample(p, size); });
}

inline Reach reach_of(PrimitiveKind kind, Vec3d v, const PrimitiveSize& s) {
  return visit_solid(kind, [&](auto solid) { return solid.reach(v, s); });
}

}  // namespace sdftrack::primitives
