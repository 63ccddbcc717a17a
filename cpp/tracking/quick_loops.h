// SPDX-License-Identifier: MIT
// The loops of quick_ops.h for the lanes L of the file that includes this; see energies/term_loops.h.
#pragma once

#include "energies/block.h"
#include "tracking/quick_ops.h"

namespace sdftrack {
namespace {

template <class L>
struct QuickLoops {
  template <class Term>
  HD static void add(const Term& given, int count, Block<6>* block, Sums<double, 6>* sums) {
    const auto term = given.template cast<L>();
    for (int k = 0; k < count; k += kWidth<L>) {
      block->put(term.linearize(indices<L>(k, count - k)), count - k);
      if (block->full()) block->template add_to<L>(sums);
    }
    block->align();
    if (block->full()) block->template add_to<L>(sums);
  }

  static Sums<double, 6> linearize(const QuickTerms& terms) {
    Sums<double, 6> sums;
    Block<6> block;
    add(terms.readings, terms.readings.readings_cam.count(), &block, &sums);
    add(terms.solids, terms.solids.readings_cam.count(), &block, &sums);
    add(terms.surface, terms.surface.points_obj.count(), &block, &sums);
    add(terms.outline, terms.outline.points_obj.count(), &block, &sums);
    if (block.filled > 0) block.template add_to<L>(&sums);
    return sums;
  }

  // counted: the points that have a cost.
  template <class Term>
  HD static double cost_of(const Term& given, int count, double* counted) {
    const auto term = given.template cast<L>();
    Row costs, counts;
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
};

}  // namespace

// SDFTRACK_LANES and SDFTRACK_SET: the lane type and the member of QuickOps that it serves.
const QuickOps QuickOps::SDFTRACK_SET = {QuickLoops<SDFTRACK_LANES>::linearize,
                                         QuickLoops<SDFTRACK_LANES>::cost};

}  // namespace sdftrack
