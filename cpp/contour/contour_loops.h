// SPDX-License-Identifier: MIT
// The loops of contour_ops.h for the lanes L of the file that includes this; see energies/term_loops.h.
#pragma once

#include "contour/contour_ops.h"
#include "energies/block.h"

namespace sdftrack::contour {
namespace {

using namespace energies;  // each_pack, Block, Row, PartialSums

template <class L>
struct ContourLoops {
  template <int P>
  static energies::Sums<double, P> linearize(const RegistrationTerm<float, P>& given) {
    RegistrationTerm<L, P> term{
        given.grid,  given.pixels, {given.b[0], given.b[1], given.b[2], given.b[3], given.b[4], given.b[5]},
        given.mid_x, given.mid_y,  given.inv_s};
    energies::Sums<double, P> sums;
    Block<P> block;
    Row<> costs;
    const auto finish = [&]() SDFTRACK_INLINE {
      sums.cost += costs.template sum<L>();
      block.template add_to<L>(&sums);
    };
    each_pack<L>(0, given.pixels.count, [&](int i, int n) SDFTRACK_INLINE {
      const energies::Contribution<L, P> c = term.at(i, n);
      costs.put(c.cost, n);
      block.put(c, n);
      if (block.full()) finish();
    });
    finish();
    sums.count = given.pixels.count;
    return sums;
  }

  static void step(const ContourStep<float>& given, const float* phi, const float* foreground, int row,
                   int count, float* out) {
    const ContourStep<L> term{given.inv_s, given.dt, given.mu, given.tension};
    each_pack<L>(0, count, [&](int i, int n) SDFTRACK_INLINE {
      store(term.step(phi + i, row, load<L>(foreground + i, n), n), out + i, n);
    });
  }

  static void min_square(const float* row_square, int row, int above, int below, int count, float* least) {
    each_pack<L>(0, count, [&](int i, int n) SDFTRACK_INLINE {
      L best = load<L>(row_square + i, n);
      for (int k = 1; k <= above; ++k) {
        const L other = load<L>(row_square + i - k * row, n) + L(float(k * k));
        best = select(other < best, other, best);
      }
      for (int k = 1; k <= below; ++k) {
        const L other = load<L>(row_square + i + k * row, n) + L(float(k * k));
        best = select(other < best, other, best);
      }
      store(best, least + i, n);
    });
  }

  static void posterior(const WindowMixture& pixels, int count, float* out) {
    each_pack<L>(0, count,
                 [&](int i, int n) SDFTRACK_INLINE { store(pixels.posterior<L>(i, n), out + i, n); });
  }

  static void sums_at(const PlacedSamples& samples, const float* u0, const float* v0, int places,
                      float* sums) {
    each_pack<L>(0, places, [&](int i, int n) SDFTRACK_INLINE {
      store(samples.sum(load<L>(u0 + i, n), load<L>(v0 + i, n)), sums + i, n);
    });
  }

  // kRows rows at once: b is loaded once for all rows, and the sums do not wait for each other.
  template <int kRows>
  static void products_of(const float* rows, const float* b, int length, float* out, int step) {
    PartialSums<L> sums[kRows];
    for (int k = 0; k < length; k += kLanes)
      for (int j = 0; j < PartialSums<L>::N; ++j) {
        const L right = load<L>(b + k + j * kWidth<L>, kWidth<L>);
        for (int i = 0; i < kRows; ++i)
          sums[i].part[j] += load<L>(rows + i * length + k + j * kWidth<L>, kWidth<L>) * right;
      }
    for (int i = 0; i < kRows; ++i) out[i * step] = float(sums[i].total());
  }

  static void products(const float* rows, int count, const float* b, int length, float* out, int step) {
    int i = 0;
    for (; i + 4 <= count; i += 4) products_of<4>(rows + i * length, b, length, out + i * step, step);
    for (; i < count; ++i) products_of<1>(rows + i * length, b, length, out + i * step, step);
  }
};

}  // namespace

// SDFTRACK_LANES and SDFTRACK_SET: the lane type and the member of ContourOps that it serves.
const ContourOps ContourOps::SDFTRACK_SET = {
    ContourLoops<SDFTRACK_LANES>::linearize<4>, ContourLoops<SDFTRACK_LANES>::linearize<6>,
    ContourLoops<SDFTRACK_LANES>::step,         ContourLoops<SDFTRACK_LANES>::min_square,
    ContourLoops<SDFTRACK_LANES>::posterior,    ContourLoops<SDFTRACK_LANES>::sums_at,
    ContourLoops<SDFTRACK_LANES>::products};

}  // namespace sdftrack::contour
