// SPDX-License-Identifier: MIT
// The loops of term_ops.h for the lanes L of the file that includes this. Every pixel's numbers are the same
// in a pack as alone, and the sums run over kLanes partial sums whatever the width of a pack: the same bits
// on every instruction set. No Eigen and no containers here, and everything internal or inlined: a function
// shared by two such files would be merged by the linker, and run where its instructions do not exist.
#pragma once

#include "energies/term_ops.h"

namespace sdftrack {
namespace {

constexpr int kLanes = 16;
constexpr int kBlock = 512;  // pixels summed in float before they go into double

// What a block of pixels contributes, in arrays: so many sums do not fit in registers together with a pixel.
template <int P>
struct Block {
  alignas(64) float cost[kBlock], slope[kBlock], curvature[kBlock], J[P][kBlock];
};

// Lanes beyond the last pixel add nothing.
template <class L>
HD L first_of(L x, int n) {
  if constexpr (kWidth<L> == 1) {
    return x;
  } else {
    float kept[kWidth<L>] = {};
    store(x, kept, n);
    return load<L>(kept, kWidth<L>);
  }
}

template <class L, class LaneTerm, int P = LaneTerm::P>
HD void fill(const LaneTerm& term, int begin, int count, Block<P>* block) {
  for (int k = 0; k < count; k += kWidth<L>) {
    const int n = count - k;
    Contribution<L, P> c = term.linearize(begin + k, n);
    if (n < kWidth<L>) {
      c.cost = first_of(c.cost, n), c.slope = first_of(c.slope, n), c.curvature = first_of(c.curvature, n);
      for (int a = 0; a < P; ++a) c.J[a] = first_of(c.J[a], n);
    }
    store(c.cost, block->cost + k, kWidth<L>);
    store(c.slope, block->slope + k, kWidth<L>);
    store(c.curvature, block->curvature + k, kWidth<L>);
    for (int a = 0; a < P; ++a) store(c.J[a], block->J[a] + k, kWidth<L>);
  }
  // Up to a whole number of partial sums.
  const int filled = (count + kWidth<L> - 1) / kWidth<L> * kWidth<L>;
  for (int k = filled; k < (count + kLanes - 1) / kLanes * kLanes; ++k) {
    block->cost[k] = block->slope[k] = block->curvature[k] = 0;
    for (int a = 0; a < P; ++a) block->J[a][k] = 0;
  }
}

template <class L>
struct PartialSums {
  static constexpr int N = kLanes / kWidth<L>;
  L part[N];

  HD PartialSums() {
    for (int j = 0; j < N; ++j) part[j] = L(0);
  }
  HD double total() const {
    float x[kLanes];
    for (int j = 0; j < N; ++j) store(part[j], x + j * kWidth<L>, kWidth<L>);
    // In halves: short chains, and an order that the width of a pack has no say in.
    for (int half = kLanes / 2; half > 0; half /= 2)
      for (int j = 0; j < half; ++j) x[j] += x[j + half];
    return static_cast<double>(x[0]);
  }
};

// Row a of the sums: its gradient and the products with the rows before it.
template <class L, int A, int P>
HD void add_row(const Block<P>& block, int count, Sums<double, P>* sums) {
  constexpr int kBase = A * (A + 1) / 2;
  PartialSums<L> gradient, hessian[A + 1];
  for (int k = 0; k < count; k += kLanes)
    for (int j = 0; j < PartialSums<L>::N; ++j) {
      const int at = k + j * kWidth<L>;
      const L J = load<L>(block.J[A] + at, kWidth<L>);
      const L weighted = load<L>(block.curvature + at, kWidth<L>) * J;
      gradient.part[j] += load<L>(block.slope + at, kWidth<L>) * J;
      for (int b = 0; b <= A; ++b) hessian[b].part[j] += weighted * load<L>(block.J[b] + at, kWidth<L>);
    }
  sums->gradient[A] += gradient.total();
  for (int b = 0; b <= A; ++b) sums->hessian[kBase + b] += hessian[b].total();
  if constexpr (A + 1 < P) add_row<L, A + 1>(block, count, sums);
}

template <class L>
HD double sum(const float* x, int count) {
  PartialSums<L> sums;
  for (int k = 0; k < count; k += kLanes)
    for (int j = 0; j < PartialSums<L>::N; ++j) sums.part[j] += load<L>(x + k + j * kWidth<L>, kWidth<L>);
  return sums.total();
}

template <class L, class Field, class Penalty>
struct Loops {
  using Given = Term<Field, Penalty>;
  static constexpr int P = Field::P;

  static Sums<double, P> linearize(const Given& given, int begin, int end) {
    const auto term = given.template cast<L>();
    Sums<double, P> sums;
    Block<P> block;
    for (int first = begin; first < end; first += kBlock) {
      const int count = end - first < kBlock ? end - first : kBlock;
      fill<L>(term, first, count, &block);
      sums.cost += sum<L>(block.cost, count);
      add_row<L, 0>(block, count, &sums);
    }
    sums.count = end - begin;
    return sums;
  }

  static double cost(const Given& given, int begin, int end) {
    const auto term = given.template cast<L>();
    alignas(64) float costs[kBlock];
    double total = 0;
    for (int first = begin; first < end; first += kBlock) {
      const int count = end - first < kBlock ? end - first : kBlock;
      for (int k = 0; k < count; k += kWidth<L>) {
        const L c = term.cost(first + k, count - k);
        store(count - k < kWidth<L> ? first_of(c, count - k) : c, costs + k, kWidth<L>);
      }
      for (int k = (count + kWidth<L> - 1) / kWidth<L> * kWidth<L>; k % kLanes != 0; ++k) costs[k] = 0;
      total += sum<L>(costs, count);
    }
    return total;
  }

  static void settle(const Given& given, int begin, int end) {
    const auto term = given.template cast<L>();
    for (int i = begin; i < end; i += kWidth<L>) term.settle(i, end - i);
  }

  static void classify(const Given& given, int begin, int end) {
    const auto term = given.template cast<L>();
    FieldRow<L, P> row;
    for (int i = begin; i < end; i += kWidth<L>) term.read(i, end - i, &row);
  }

  static void distances(const Given& given, int begin, int end, float* phi_m) {
    const auto term = given.template cast<L>();
    for (int i = begin; i < end; i += kWidth<L>) store(term.distance(i, end - i), phi_m + i - begin, end - i);
  }
};

}  // namespace
}  // namespace sdftrack

// SDFTRACK_LANES and SDFTRACK_SET: the lane type and the member of OpsOf that it serves.
namespace sdftrack {
#define SDFTRACK_PAIR(name, field, penalty)                                                           \
  template <>                                                                                         \
  const TermOps<field, penalty> OpsOf<field, penalty>::SDFTRACK_SET = {                               \
      Loops<SDFTRACK_LANES, field, penalty>::linearize, Loops<SDFTRACK_LANES, field, penalty>::cost,  \
      Loops<SDFTRACK_LANES, field, penalty>::settle, Loops<SDFTRACK_LANES, field, penalty>::classify, \
      Loops<SDFTRACK_LANES, field, penalty>::distances};
#include "energies/compiled.inc"
#undef SDFTRACK_PAIR
}  // namespace sdftrack
