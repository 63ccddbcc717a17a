// SPDX-License-Identifier: MIT
// The loops of term_ops.h for the lanes L of the file that includes this. It uses no Eigen and no containers,
// and everything is internal or inlined: the linker would merge a function shared by two such files, which
// could then run where its instructions do not exist.
#pragma once

#include "energies/summary_loops.h"
#include "energies/term_ops.h"

namespace sdftrack::energies {
namespace {

// The loops that do not depend on the penalty, once for all energies of a field.
template <class L, class Field>
struct FieldLoops {
  using Given = Term<Field, NoPenalty>;

  __attribute__((noinline)) static void settle(const Given& given, int begin, int end) {
    const auto term = given.template cast<L>();
    each_pack<L>(begin, end, [&](int i, int n) SDFTRACK_INLINE { term.settle(i, n); });
  }

  __attribute__((noinline)) static void classify(const Given& given, int begin, int end) {
    const auto term = given.template cast<L>();
    each_pack<L>(begin, end, [&](int i, int n) SDFTRACK_INLINE {
      FieldRow<L, Field::P> row;
      term.read(i, n, &row);
    });
  }

  __attribute__((noinline)) static void distances(const Given& given, int begin, int end, float* phi_m) {
    const auto term = given.template cast<L>();
    each_pack<L>(begin, end,
                 [&](int i, int n) SDFTRACK_INLINE { store(term.distance(i, n), phi_m + i - begin, n); });
  }
};

template <class L, class Field, class Penalty>
struct Loops {
  using Given = Term<Field, Penalty>;
  static constexpr int P = Field::P;

  static Sums<double, P> linearize(const Given& given, int begin, int end) {
    const auto term = given.template cast<L>();
    Sums<double, P> sums;
    Row<> costs;
    Block<P> block;
    each_pack<L>(begin, end, [&](int i, int n) SDFTRACK_INLINE {
      const auto contribution = term.linearize(i, n);
      costs.put(contribution.cost, n);
      block.put(contribution, n);
      if (block.full()) sums.cost += costs.template sum<L>(), block.template add_to<L>(&sums);
    });
    sums.cost += costs.template sum<L>(), block.template add_to<L>(&sums);
    sums.count = end - begin;
    return sums;
  }

  static double cost(const Given& given, int begin, int end) {
    const auto term = given.template cast<L>();
    Row<> costs;
    double total = 0;
    each_pack<L>(begin, end, [&](int i, int n) SDFTRACK_INLINE {
      costs.put(term.cost(i, n), n);
      if (costs.full()) total += costs.template sum<L>();
    });
    return total + costs.template sum<L>();
  }

  static void settle(const Given& given, int begin, int end) {
    FieldLoops<L, Field>::settle(given.without_penalty(), begin, end);
  }
  static void classify(const Given& given, int begin, int end) {
    FieldLoops<L, Field>::classify(given.without_penalty(), begin, end);
  }
  static void distances(const Given& given, int begin, int end, float* phi_m) {
    FieldLoops<L, Field>::distances(given.without_penalty(), begin, end, phi_m);
  }

  static TermSums<P> summarize(const Given& given, int budget, float voxel_m, bool missed, float* residual_m,
                               int* at) {
    const auto term = given.template cast<L>();
    TermSums<P> sums;
    if constexpr (P <= kMaxUnknowns) {
      note<L>(term, budget, voxel_m, residual_m, at, &sums);
      if (missed) note_missed<L>(term, &sums);
    }
    return sums;
  }
};

}  // namespace
}  // namespace sdftrack::energies

// SDFTRACK_LANES and SDFTRACK_SET: the lane type and the member of OpsOf that it serves.
namespace sdftrack::energies {
#define SDFTRACK_PAIR(name, field, penalty)                                                              \
  template <>                                                                                            \
  const TermOps<field, penalty> OpsOf<field, penalty>::SDFTRACK_SET = {                                  \
      Loops<SDFTRACK_LANES, field, penalty>::linearize, Loops<SDFTRACK_LANES, field, penalty>::cost,     \
      Loops<SDFTRACK_LANES, field, penalty>::settle,    Loops<SDFTRACK_LANES, field, penalty>::classify, \
      Loops<SDFTRACK_LANES, field, penalty>::distances, Loops<SDFTRACK_LANES, field, penalty>::summarize};
#include "energies/compiled.inc"
#undef SDFTRACK_PAIR
}  // namespace sdftrack::energies
