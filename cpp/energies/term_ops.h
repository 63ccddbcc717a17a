// SPDX-License-Identifier: MIT
// The loops over pixels, compiled once per instruction set: a table of functions for each (field, penalty)
// pair of compiled.inc. All of them compute the same bits (term_loops.h).
#pragma once

#include "base/isa.h"
#include "energies/term_sums.h"

namespace sdftrack::energies {

// Number of partial sums of every sum, whatever the width of a pack.
constexpr int kLanes = 16;
HD constexpr int whole_lanes(int count) { return (count + kLanes - 1) / kLanes * kLanes; }

// Loops over pixels [begin, end). The caller cuts work for several threads into chunks.
template <class Field, class Penalty>
struct TermOps {
  using Loop = Term<Field, Penalty>;
  Sums<double, Field::P> (*linearize)(const Loop&, int begin, int end);
  double (*cost)(const Loop&, int begin, int end);
  void (*settle)(const Loop&, int begin, int end);
  void (*classify)(const Loop&, int begin, int end);
  void (*distances)(const Loop&, int begin, int end, float* phi_m);
  // Sums, residuals and indices of about `budget` pixels (a multiple of kLanes); see term_sums.h. If
  // `missed`, TermSums::missed is summed over all pixels.
  TermSums<Field::P> (*summarize)(const Loop&, int budget, float voxel_m, bool missed, float* residual_m,
                                  int* at);
};

// Defined in ops_*.cpp.
template <class Field, class Penalty>
struct OpsOf {
  static const TermOps<Field, Penalty> baseline, avx2, avx512;
};

template <class Field, class Penalty>
const TermOps<Field, Penalty>& ops_for(Isa isa) {
  return for_isa<OpsOf<Field, Penalty>>(isa);
}

}  // namespace sdftrack::energies
