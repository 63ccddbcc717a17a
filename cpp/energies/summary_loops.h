// SPDX-License-Identifier: MIT
// The sums of term_sums.h in lanes; see term_loops.h.
#pragma once

#include "energies/block.h"
#include "energies/term_sums.h"

namespace sdftrack::energies {
namespace {

constexpr int kNoteBlock = 128;
constexpr float kSteepGain = 2;  // 60 degrees from the normal
constexpr int kErrorRuns = 16;   // least number of runs that evaluate the interpolant's error

// The sums of one class while they are built.
template <int P>
struct ClassSums {
  Block<P, kNoteBlock> JJ;
  Row<kNoteBlock> curvature, slope2, weight;
  bool some = false;  // a block without a pixel of this class is not summed

  template <class L, class Mask>
  HD void put(const Contribution<L, P>& c, L second, L slope, L w, Mask in) {
    some |= any(in);
    JJ.put(c, kWidth<L>);
    curvature.put(second, kWidth<L>), slope2.put(slope * slope, kWidth<L>), weight.put(w, kWidth<L>);
  }
  template <class L>
  HD void add_to(typename TermSums<P>::Class* out) {
    if (!some) {
      JJ.filled = curvature.filled = slope2.filled = weight.filled = 0;
      return;
    }
    some = false;
    JJ.template add_to<L>(&out->JJ);
    out->curvature += curvature.template sum<L>(), out->slope2 += slope2.template sum<L>();
    out->weight += weight.template sum<L>();
  }
};

template <class L, class LaneTerm>
struct Notes {
  static constexpr int P = LaneTerm::P;
  const LaneTerm& term;
  L voxel_m;
  TermSums<P>* out;
  ClassSums<P> classes[3];
  Block<P, kNoteBlock> inliers;
  Row<kNoteBlock> counted;

  // Adds n pixels from i on; returns their residuals. share: factor of the interpolant's error; 0: none.
  HD L put(int i, int n, float share) {
    FieldRow<L, P> row;
    const auto reading = term.read(i, n, &row);
    const L residual = reading.residual_m, gain2 = reading.gain * reading.gain;
    const L s = term.penalty.scale_m / load<L>(term.pixels.per_noise + i, n), zero = L(0);
    using Mask = typename LaneTerm::Mask;
    const L class_gain = load<L>(term.pixels.gain + i, n);
    const Mask there = among_first<L>(n), hit = class_gain == zero;
    const Curve<L> curve = term.curve(i, n, residual);
    const L second = term.second_derivative(i, n, residual);
    L weight = curve.curvature;
    if constexpr (!LaneTerm::kColor)
      weight = select(abs(residual) > L(1e-3f) * s, curve.slope / residual, L(0.5f) / (s * s));
    const Mask fallback = there & (class_gain != zero),
               flat = there & hit & (gain2 < L(kSteepGain * kSteepGain)),
               steep = there & hit & (gain2 >= L(kSteepGain * kSteepGain));
    const Mask of_class[3] = {fallback, flat, steep};
    for (int c = 0; c < 3; ++c) {
      const Mask in = of_class[c];
      classes[c].put(of(row, zero, select(in, gain2 * weight, zero)), select(in, second, zero),
                     select(in, curve.slope, zero), select(in, weight, zero), in);
    }
    // Inlier: more than half of the weight of a residual of 0.
    const L inlier = select(there & (weight * L(4) * s * s > L(1)), L(1), zero);
    L pull = zero;
    if (share > 0) {
      const L error =
          interpolation_error(term.field, load<L>(term.pixels.hit_m + i, n) * term.ray_of(i, n), voxel_m);
      pull = select(there & hit, L(share) * gain2 * second * error, zero);
    }
    inliers.put(of(row, pull, inlier), kWidth<L>), counted.put(inlier, kWidth<L>);
    if (inliers.full()) flush();
    return residual;
  }

  HD void flush() {
    for (int c = 0; c < 3; ++c) classes[c].template add_to<L>(&out->classes[c]);
    inliers.template add_to<L>(&out->inliers);
    out->inliers.count += counted.template sum<L>();
  }

  static HD Contribution<L, P> of(const FieldRow<L, P>& row, L slope, L curvature) {
    Contribution<L, P> c{L(0), slope, curvature, {}};
    for (int j = 0; j < P; ++j) c.J[j] = row.J[j];
    return c;
  }
};

// Sums runs of kLanes pixels, spread evenly, about `budget` pixels in all. Their residuals go to residual_m
// and their indices to `at`, both with room for whole_lanes(budget).
template <class L, class LaneTerm, int P = LaneTerm::P>
HD void note(const LaneTerm& term, int budget, float voxel_m, float* residual_m, int* at, TermSums<P>* out) {
  const int count = term.pixels.count, all = whole_lanes(count) / kLanes;
  const int runs = all < budget / kLanes ? all : budget / kLanes;
  const int every = runs < 2 * kErrorRuns ? 1 : runs / kErrorRuns, looks = (runs + every - 1) / every;
  const float share = looks > 0 ? float(runs) / float(looks) : 0;
  Notes<L, LaneTerm> notes{term, L(voxel_m), out, {}, {}, {}};
  for (int k = 0; k < runs; ++k) {
    const int first = int(static_cast<long>(k) * all / runs) * kLanes;
    const int end = first + kLanes < count ? first + kLanes : count;
    for (int i = first; i < end; i += kWidth<L>) {
      const int n = end - i < kWidth<L> ? end - i : kWidth<L>;
      const L residual = notes.put(i, n, k % every == 0 ? share : 0.0f);
      for (int j = 0; j < n; ++j) at[out->count + j] = i + j;
      store(residual, residual_m + out->count, n), out->count += n;
    }
  }
  notes.flush();
}

// The gradient of the pixels whose rays miss the model, by whole runs: the same sums for all packs.
template <class L, class LaneTerm, int P = LaneTerm::P>
HD void note_missed(const LaneTerm& term, TermSums<P>* out) {
  Block<P, kNoteBlock> block;
  const L zero = L(0);
  for (int first = 0; first < term.pixels.count; first += kLanes) {
    const int end = first + kLanes < term.pixels.count ? first + kLanes : term.pixels.count;
    bool some = false;
    for (int i = first; i < end; ++i) some |= term.pixels.gain[i] != 0;
    if (!some) continue;
    for (int i = first; i < end; i += kWidth<L>) {
      const int n = end - i;
      FieldRow<L, P> row;
      const auto reading = term.read_fallback(i, n, &row);
      const L pull = reading.gain * term.curve(i, n, reading.residual_m).slope;
      const auto miss = load<L>(term.pixels.gain + i, n) != zero;
      block.put(Notes<L, LaneTerm>::of(row, select(miss, pull, zero), zero), n);
    }
    block.align();
    if (block.full()) block.template add_to<L>(&out->missed);
  }
  if (block.filled > 0) block.template add_to<L>(&out->missed);
}

}  // namespace
}  // namespace sdftrack::energies
