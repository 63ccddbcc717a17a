// SPDX-License-Identifier: MIT
// The loops of point_ops.h for the lanes L of the file that includes this; see energies/term_loops.h.
#pragma once

#include "energies/block.h"
#include "frame/point_ops.h"

namespace sdftrack::frame {
namespace {

using namespace energies;  // each_pack, Block, Row, PartialSums

template <class L>
struct PointLoops {
  template <class Term>
  HD static void add(const Term& given, int count, Block<6>* block, energies::Sums<double, 6>* sums) {
    const auto term = given.template cast<L>();
    for (int k = 0; k < count; k += kWidth<L>) {
      block->put(term.linearize(indices<L>(k, count - k)), count - k);
      if (block->full()) block->template add_to<L>(sums);
    }
    block->align();
    if (block->full()) block->template add_to<L>(sums);
  }

  static energies::Sums<double, 6> linearize(const QuickTerms& terms) {
    energies::Sums<double, 6> sums;
    Block<6> block;
    add(terms.readings, terms.readings.readings_cam.count(), &block, &sums);
    add(terms.solids, terms.solids.readings_cam.count(), &block, &sums);
    add(terms.surface, terms.surface.points_obj.count(), &block, &sums);
    add(terms.outline, terms.outline.points_obj.count(), &block, &sums);
    if (block.filled > 0) block.template add_to<L>(&sums);
    return sums;
  }

  // counted: the number of points that have a cost.
  template <class Term>
  HD static double cost_of(const Term& given, int count, double* counted) {
    const auto term = given.template cast<L>();
    Row<> costs, counts;
    double total = 0;
    for (int k = 0; k < count; k += kWidth<L>) {
      const auto c = term.linearize(indices<L>(k, count - k));
      costs.put(c.cost, count - k);
      counts.put(select(c.curvature > L(0), L(1), L(0)), count - k);
      if (costs.full()) total += costs.template sum<L>(), *counted += counts.template sum<L>();
    }
    *counted += counts.template sum<L>();
    return total + costs.template sum<L>();
  }

  static QuickCost cost(const QuickTerms& terms) {
    QuickCost cost;
    double unused = 0;
    cost.readings = cost_of(terms.readings, terms.readings.readings_cam.count(), &unused) +
                    cost_of(terms.solids, terms.solids.readings_cam.count(), &unused);
    cost.surface = cost_of(terms.surface, terms.surface.points_obj.count(), &cost.surface_points);
    cost.outline = cost_of(terms.outline, terms.outline.points_obj.count(), &unused);
    return cost;
  }

  static int explained(const ExplainedTerm<float>& given) {
    const auto term = given.template cast<L>();
    const int count = term.readings_cam.count();
    int total = 0, unused[energies::kLanes];
    for (int k = 0; k < count; k += kWidth<L>)
      total += keep(term.explains(indices<L>(k, count - k)) & among_first<L>(count - k), k, unused);
    return total;
  }

  HD static int count_from(const PointsView& points, int first) {
    const int left = points.count() - first;
    return left < kPointsAtOnce ? left : kPointsAtOnce;
  }

  static void sights(const SightTerm<float>& given, int first, Sights* out) {
    const auto term = given.template cast<L>();
    const int count = count_from(given.points_obj, first);
    int facing[kPointsAtOnce + energies::kLanes];
    out->count = 0;
    for (int k = 0; k < count; k += kWidth<L>) {
      const auto yes = term.faces(indices<L>(first + k, count - k)) & among_first<L>(count - k);
      out->count += keep(yes, first + k, facing + out->count);
    }
    for (int k = 0; k < out->count; k += kWidth<L>) {
      const Sight<L> sight = term.look(load_indices<L>(facing + k, out->count - k));
      store(sight.facing, out->facing + k, kWidth<L>), store(sight.p_cam.x, out->x_m + k, kWidth<L>);
      store(sight.p_cam.y, out->y_m + k, kWidth<L>), store(sight.p_cam.z, out->z_m + k, kWidth<L>);
    }
  }

  static void bearings(const BearingTerm<float>& given, int first, Bearings* out) {
    const auto term = given.template cast<L>();
    out->count = count_from(given.points_obj, first);
    for (int k = 0; k < out->count; k += kWidth<L>) {
      const Bearing<L> bearing = term.look(indices<L>(first + k, out->count - k));
      store(bearing.turn, out->turn + k, kWidth<L>), store(bearing.radius_px, out->radius_px + k, kWidth<L>);
      store(bearing.depth_m, out->depth_m + k, kWidth<L>);
    }
  }

  static void pulls(const PullTerm<float>& given, int count, float* pull) {
    const auto term = given.template cast<L>();
    each_pack<L>(0, count, [&](int i, int n) SDFTRACK_INLINE { store(term.pull(i, n), pull + i, n); });
  }

  static int candidates(const SelectTerm<float>& given, int y, int x0, int x1, int* at) {
    const auto term = given.template cast<L>();
    int found = 0;
    each_pack<L>(x0, x1, [&](int x, int n) SDFTRACK_INLINE {
      const auto requested = term.wants(x, y, n);
      if (any(requested)) found += keep(requested, y * term.width + x, at + found);
    });
    return found;
  }
};

}  // namespace

// SDFTRACK_LANES and SDFTRACK_SET: the lane type and the member of PointOps that it serves.
const PointOps PointOps::SDFTRACK_SET = {
    PointLoops<SDFTRACK_LANES>::linearize, PointLoops<SDFTRACK_LANES>::cost,
    PointLoops<SDFTRACK_LANES>::explained, PointLoops<SDFTRACK_LANES>::sights,
    PointLoops<SDFTRACK_LANES>::bearings,  PointLoops<SDFTRACK_LANES>::pulls,
    PointLoops<SDFTRACK_LANES>::candidates};

}  // namespace sdftrack::frame
