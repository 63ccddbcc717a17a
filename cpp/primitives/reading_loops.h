// SPDX-License-Identifier: MIT
// The loops of reading_ops.h for the lanes L of the file that includes this; see energies/term_loops.h.
#pragma once

#include "energies/block.h"
#include "primitives/reading_ops.h"

namespace sdftrack::primitives {
namespace {

using namespace energies;  // each_pack, Block, Row, PartialSums

template <class L, PrimitiveKind kKind>
struct ReadingLoops {
  static constexpr int kSizes = size_count(kKind), P = 6 + kSizes;

  // The term in lanes.
  struct Solid {
    const ReadingTerm& given;
    Mat3<L> R;
    Vec3<L> t;
    L size[sdf::kMaxSizes], per_s, inlier, floor;

    HD explicit Solid(const ReadingTerm& g)
        : given(g),
          R{g.R[0].template cast<L>(), g.R[1].template cast<L>(), g.R[2].template cast<L>()},
          t(g.t_m.template cast<L>()),
          size{L(g.size_m[0]), L(g.size_m[1]), L(g.size_m[2])},
          per_s(g.per_s),
          inlier(1 - g.outlier_floor),
          floor(g.outlier_floor) {}

    HD Vec3<L> point(int i, int n) const {
      return R * Vec3<L>{load<L>(given.x_m + i, n), load<L>(given.y_m + i, n), load<L>(given.z_m + i, n)} + t;
    }
    HD energies::Curve<L> curve(L phi) const {
      return energies::logistic_mixture(phi, per_s, inlier, floor, energies::Curvature::kIrls);
    }
  };

  static void linearize(const ReadingTerm& given, Weighing weighing, ReadingSums* out) {
    const Solid solid(given);
    Row<> costs;
    Block<P> block;
    energies::Sums<double, P> sums;
    each_pack<L>(0, given.count, [&](int i, int n) SDFTRACK_INLINE {
      const Vec3<L> p = solid.point(i, n);
      const sdf::SolidSample<L> s = SolidTraits<kKind>::sample(p, solid.size);
      const Vec3<L> m = cross(p, s.grad);
      const energies::Curve<L> c = solid.curve(s.phi_m);
      energies::Contribution<L, P> row{
          c.cost, c.slope, c.curvature, {s.grad.x, s.grad.y, s.grad.z, m.x, m.y, m.z}};
      if (weighing == Weighing::kSecond)
        row.curvature = energies::logistic_mixture_second(s.phi_m, solid.per_s, solid.inlier, solid.floor);
      if (weighing == Weighing::kSquare) row.curvature = c.slope * c.slope;
      for (int k = 0; k < kSizes; ++k) row.J[6 + k] = solid.size[k] * s.size[k];  // by the logarithm
      costs.put(c.cost, n);
      block.put(row, n);
      if (block.full()) sums.cost += costs.template sum<L>(), block.template add_to<L>(&sums);
    });
    out->cost += sums.cost + costs.template sum<L>();
    block.template add_to<L>(&sums);
    for (int a = 0; a < P; ++a) out->gradient[a] += sums.gradient[a];
    for (int k = 0; k < P * (P + 1) / 2; ++k) out->hessian[k] += sums.hessian[k];
  }

  static double cost(const ReadingTerm& given) {
    const Solid solid(given);
    Row<> costs;
    double total = 0;
    each_pack<L>(0, given.count, [&](int i, int n) SDFTRACK_INLINE {
      costs.put(solid.curve(SolidTraits<kKind>::sample(solid.point(i, n), solid.size).phi_m).cost, n);
      if (costs.full()) total += costs.template sum<L>();
    });
    return total + costs.template sum<L>();
  }

  static void residuals(const ReadingTerm& given, float* phi_m) {
    const Solid solid(given);
    each_pack<L>(0, given.count, [&](int i, int n) SDFTRACK_INLINE {
      store(SolidTraits<kKind>::sample(solid.point(i, n), solid.size).phi_m, phi_m + i, n);
    });
  }
};

template <class L, int... k>
constexpr ReadingOps ops_of(std::integer_sequence<int, k...>) {
  return {{ReadingLoops<L, static_cast<PrimitiveKind>(k)>::linearize...},
          {ReadingLoops<L, static_cast<PrimitiveKind>(k)>::cost...},
          {ReadingLoops<L, static_cast<PrimitiveKind>(k)>::residuals...}};
}

}  // namespace

// SDFTRACK_LANES and SDFTRACK_SET: the lane type and the member of ReadingOps that it serves.
constinit const ReadingOps ReadingOps::SDFTRACK_SET =
    ops_of<SDFTRACK_LANES>(std::make_integer_sequence<int, kPrimitiveKinds>{});

}  // namespace sdftrack::primitives
