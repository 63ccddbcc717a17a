// SPDX-License-Identifier: MIT
// The loops of reading_ops.h for the lanes L of the file that includes this; see energies/term_loops.h.
#pragma once

#include "energies/block.h"
#include "primitives/along_ray.h"
#include "primitives/outline_curve.h"
#include "primitives/reading_ops.h"

namespace sdftrack::primitives {
namespace {

using namespace energies;  // each_pack, Block, Row, PartialSums

// A solid in lanes of L.
template <class L, PrimitiveKind kKind>
struct LaneSolid {
  static constexpr int kSizes = size_count(kKind), P = 6 + kSizes;

  Mat3<L> R;
  Vec3<L> t;
  L size[sdf::kMaxSizes];

  HD explicit LaneSolid(const FloatSolid& g)
      : R{g.R[0].template cast<L>(), g.R[1].template cast<L>(), g.R[2].template cast<L>()},
        t(g.t_m.template cast<L>()),
        size{L(g.size_m[0]), L(g.size_m[1]), L(g.size_m[2]), L(g.size_m[3]), L(g.size_m[4])} {}

  HD auto operator()(const Vec3<L>& p_obj) const { return SolidTraits<kKind>::sample(p_obj, size); }
  // d phi / d unknowns.
  template <int N>
  HD void derivative(const RayPlace<L, N>& at, L (&J)[P]) const {
    const Vec3<L> m = cross(at.p, at.s.grad);
    const L pose[6] = {at.s.grad.x, at.s.grad.y, at.s.grad.z, m.x, m.y, m.z};
    for (int j = 0; j < 6; ++j) J[j] = pose[j];
    for (int k = 0; k < kSizes; ++k) J[6 + k] = size[k] * at.s.size[k];  // with respect to the logarithm
  }
};

template <class L, PrimitiveKind kKind>
struct Readings {
  using Solid = LaneSolid<L, kKind>;
  static constexpr int P = Solid::P;
  using Term = ReadingTerm;

  const ReadingTerm& given;
  Solid solid;
  L per_s, inlier, floor;

  HD explicit Readings(const ReadingTerm& g)
      : given(g), solid(g.solid), per_s(g.per_s), inlier(1 - g.outlier_floor), floor(g.outlier_floor) {}

  HD auto look(int i, int n) const {
    const Vec3<L> p =
        solid.R * Vec3<L>{load<L>(given.x_m + i, n), load<L>(given.y_m + i, n), load<L>(given.z_m + i, n)} +
        solid.t;
    using Meeting = decltype(meet_solid<SolidTraits<kKind>>(p, p, solid.size));
    if (given.ray_x)
      return meet_solid<SolidTraits<kKind>>(
          p, solid.R * Vec3<L>{load<L>(given.ray_x + i, n), load<L>(given.ray_y + i, n), L(1)}, solid.size);
    const auto s = solid(p);
    return Meeting{s.phi_m, L(1), {p, s}};
  }
  HD L noise(int i, int n) const { return given.per_noise ? per_s * load<L>(given.per_noise + i, n) : per_s; }
  HD L value(int i, int n) const { return look(i, n).m; }
  HD L cost(int i, int n) const {
    return energies::logistic_mixture(value(i, n), noise(i, n), inlier, floor, energies::Curvature::kIrls)
        .cost;
  }
  HD energies::Contribution<L, P> linearize(int i, int n, Weighing weighing) const {
    const auto met = look(i, n);
    const L per = noise(i, n);
    const energies::Curve<L> c =
        energies::logistic_mixture(met.m, per, inlier, floor, energies::Curvature::kIrls);
    energies::Contribution<L, P> row{c.cost, c.slope, c.curvature, {}};
    if (weighing == Weighing::kSecond)
      row.curvature = energies::logistic_mixture_second(met.m, per, inlier, floor);
    if (weighing == Weighing::kSquare) row.curvature = c.slope * c.slope;
    solid.derivative(met.at, row.J);
    for (L& j : row.J) j = met.factor * j;
    return row;
  }
};

template <class L, PrimitiveKind kKind>
struct Outline {
  using Solid = LaneSolid<L, kKind>;
  static constexpr int P = Solid::P;
  using Term = OutlineTerm;

  const OutlineTerm& given;
  Solid solid;

  HD explicit Outline(const OutlineTerm& g) : given(g), solid(g.solid) {}

  HD auto look(int i, int n) const {
    const Vec3<L> ray{load<L>(given.ray_x + i, n), load<L>(given.ray_y + i, n), L(1)};
    auto out = least_along_solid<SolidTraits<kKind>>(solid.t, solid.R * ray, load<L>(given.near_m + i, n),
                                                     load<L>(given.far_m + i, n), solid.size);
    out.m = out.m + load<L>(given.slack_m + i, n);
    return out;
  }
  // 0 for a pixel that does not count.
  HD OutlineCost<L> costs(L d, int i, int n) const {
    const auto lost = load<L>(given.lost + i, n) > L(0);
    OutlineCost<L> out = primitives::outline_cost(d, L(given.scale_px) * load<L>(given.pixel_m + i, n),
                                                  select(lost, L(given.lost_floor), L(given.floor)),
                                                  load<L>(given.side + i, n));
    if (given.lost_counts) return out;
    for (L* x : {&out.curve.cost, &out.curve.slope, &out.curve.curvature, &out.second})
      *x = select(lost, L(0), *x);
    return out;
  }
  HD L value(int i, int n) const { return look(i, n).m; }
  HD L cost(int i, int n) const { return costs(value(i, n), i, n).curve.cost; }
  HD energies::Contribution<L, P> linearize(int i, int n, Weighing weighing) const {
    const auto least = look(i, n);
    const OutlineCost<L> c = costs(least.m, i, n);
    energies::Contribution<L, P> row{c.curve.cost, c.curve.slope, c.curve.curvature, {}};
    if (weighing == Weighing::kSecond) row.curvature = c.second;
    if (weighing == Weighing::kSquare) row.curvature = c.curve.slope * c.curve.slope;
    L low[P], high[P];
    solid.derivative(least.low, low), solid.derivative(least.high, high);
    for (int j = 0; j < P; ++j) row.J[j] = least.share * low[j] + (L(1) - least.share) * high[j];
    return row;
  }
};

// The sums over all elements of a term; Of: Readings or Outline.
template <class L, class Of>
struct TermLoops {
  static constexpr int P = Of::P;
  using Term = typename Of::Term;

  static void linearize(const Term& given, Weighing weighing, ReadingSums* out) {
    const Of term(given);
    Row<> costs;
    Block<P> block;
    energies::Sums<double, P> sums;
    each_pack<L>(0, given.count, [&](int i, int n) SDFTRACK_INLINE {
      const energies::Contribution<L, P> row = term.linearize(i, n, weighing);
      costs.put(row.cost, n);
      block.put(row, n);
      if (block.full()) sums.cost += costs.template sum<L>(), block.template add_to<L>(&sums);
    });
    out->cost += sums.cost + costs.template sum<L>();
    block.template add_to<L>(&sums);
    for (int a = 0; a < P; ++a) out->gradient[a] += sums.gradient[a];
    for (int k = 0; k < P * (P + 1) / 2; ++k) out->hessian[k] += sums.hessian[k];
  }

  static double cost(const Term& given) {
    const Of term(given);
    Row<> costs;
    double total = 0;
    each_pack<L>(0, given.count, [&](int i, int n) SDFTRACK_INLINE {
      costs.put(term.cost(i, n), n);
      if (costs.full()) total += costs.template sum<L>();
    });
    return total + costs.template sum<L>();
  }

  static void values(const Term& given, float* m) {
    const Of term(given);
    each_pack<L>(0, given.count, [&](int i, int n) SDFTRACK_INLINE { store(term.value(i, n), m + i, n); });
  }
};

template <class L, PrimitiveKind kKind>
using ReadingLoops = TermLoops<L, Readings<L, kKind>>;
template <class L, PrimitiveKind kKind>
using OutlineLoops = TermLoops<L, Outline<L, kKind>>;

template <class L, int... k>
constexpr ReadingOps ops_of(std::integer_sequence<int, k...>) {
  return {{ReadingLoops<L, static_cast<PrimitiveKind>(k)>::linearize...},
          {ReadingLoops<L, static_cast<PrimitiveKind>(k)>::cost...},
          {ReadingLoops<L, static_cast<PrimitiveKind>(k)>::values...},
          {OutlineLoops<L, static_cast<PrimitiveKind>(k)>::linearize...},
          {OutlineLoops<L, static_cast<PrimitiveKind>(k)>::cost...},
          {OutlineLoops<L, static_cast<PrimitiveKind>(k)>::values...}};
}

}  // namespace

// SDFTRACK_LANES and SDFTRACK_SET: the lane type and the member of ReadingOps that it serves.
constinit const ReadingOps ReadingOps::SDFTRACK_SET =
    ops_of<SDFTRACK_LANES>(std::make_integer_sequence<int, kPrimitiveKinds>{});

}  // namespace sdftrack::primitives
