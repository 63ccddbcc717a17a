// SPDX-License-Identifier: MIT
// Sums over a block of contributions, for the files that are compiled once per instruction set. They run over
// kLanes partial sums whatever the width of a pack L: the same bits on every instruction set.
#pragma once

#include "energies/term_ops.h"

namespace sdftrack::energies {
namespace {

constexpr int kBlock = 512;  // contributions summed in float before they are added in double

// x in the first n lanes, 0 in the others.
template <class L>
HD L first_of(L x, int n) {
  return n >= kWidth<L> ? x : select(among_first<L>(n), x, L(0));
}

// Calls body(i, n) for pixels begin .. end - 1: for whole packs, with constant n, and last for the rest.
template <class L, class Body>
HD void each_pack(int begin, int end, const Body& body) {
  int i = begin;
  for (; i + kWidth<L> <= end; i += kWidth<L>) body(i, kWidth<L>);
  if (i < end) body(i, end - i);
}
#define SDFTRACK_INLINE __attribute__((always_inline))

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
    // In halves: short chains, and an order that does not depend on the width of a pack.
    for (int half = kLanes / 2; half > 0; half /= 2)
      for (int j = 0; j < half; ++j) x[j] += x[j + half];
    return double(x[0]);
  }
};

// A row of numbers to be summed, filled by whole packs.
template <int kSize = kBlock>
struct Row {
  int filled = 0;
  alignas(64) float x[kSize];

  // n: how many lanes count. There must be room for a whole pack.
  template <class L>
  HD void put(L value, int n) {
    store(first_of(value, n), x + filled, kWidth<L>);
    filled += kWidth<L>;
  }
  HD bool full() const { return filled == kSize; }
  template <class L>
  HD double sum() {
    for (; filled % kLanes != 0; ++filled) x[filled] = 0;
    PartialSums<L> sums;
    for (int k = 0; k < filled; k += kLanes)
      for (int j = 0; j < PartialSums<L>::N; ++j) sums.part[j] += load<L>(x + k + j * kWidth<L>, kWidth<L>);
    filled = 0;
    return sums.total();
  }
};

// Contributions in rows that lie `stride` apart.
struct BlockView {
  const float *slope, *curvature, *J;
  int stride, filled;
};

// Adds rows 0 to A of the sums. A row consists of its gradient and its products with itself and the rows
// before it. Not inlined: it is long, and the same for all energies with more than A unknowns.
template <class L, int A>
__attribute__((noinline)) void add_rows(const BlockView& block, double* gradient, double* hessian) {
  if constexpr (A > 0) add_rows<L, A - 1>(block, gradient, hessian);
  PartialSums<L> slopes, products[A + 1];
  for (int k = 0; k < block.filled; k += kLanes)
    for (int j = 0; j < PartialSums<L>::N; ++j) {
      const int at = k + j * kWidth<L>;
      const L row = load<L>(block.J + A * block.stride + at, kWidth<L>);
      const L weighted = load<L>(block.curvature + at, kWidth<L>) * row;
      slopes.part[j] += load<L>(block.slope + at, kWidth<L>) * row;
      for (int b = 0; b <= A; ++b)
        products[b].part[j] += weighted * load<L>(block.J + b * block.stride + at, kWidth<L>);
    }
  gradient[A] += slopes.total();
  for (int b = 0; b <= A; ++b) hessian[A * (A + 1) / 2 + b] += products[b].total();
}

// Contributions without their costs. The sums of a pixel do not all fit in registers: first all rows are
// stored, then their products are summed.
template <int P, int kSize = kBlock>
struct Block {
  int filled = 0;
  alignas(64) float slope[kSize], curvature[kSize], J[P][kSize];

  template <class L>
  HD void put(const Contribution<L, P>& c, int n) {
    store(first_of(c.slope, n), slope + filled, kWidth<L>);
    store(first_of(c.curvature, n), curvature + filled, kWidth<L>);
    for (int a = 0; a < P; ++a) store(first_of(c.J[a], n), J[a] + filled, kWidth<L>);
    filled += kWidth<L>;
  }
  HD bool full() const { return filled == kSize; }
  // Pads to a multiple of kLanes, so that later contributions fall into the same partial sums for any width.
  HD void align() {
    for (; filled % kLanes != 0; ++filled) {
      slope[filled] = curvature[filled] = 0;
      for (int a = 0; a < P; ++a) J[a][filled] = 0;
    }
  }
  template <class L>
  HD void add_to(Sums<double, P>* sums) {
    align();
    add_rows<L, P - 1>({slope, curvature, J[0], kSize, filled}, sums->gradient, sums->hessian);
    filled = 0;
  }
};

}  // namespace
}  // namespace sdftrack::energies
