// SPDX-License-Identifier: MIT
// Loops over the fields of one output, compiled once per instruction set like energies/term_ops.h. All sets
// give the same bits.
#pragma once

#include "base/isa.h"
#include "lwpr/layout.h"

namespace sdftrack {

// The blocks that a sample must visit: all of them, or a list in ascending order.
struct BlockList {
  const double* blocks;
  const int* list;  // nullptr: 0 to count - 1
  int count;
};

struct FieldSums {
  double w, wy;  // of the activations of the fields that are ready, and times what they say
};

struct UnitOps {
  // Fields with q = -2 log w below q_max, in ascending order, and their activations. Room for a whole block
  // more.
  int (*active)(const FieldLayout&, const BlockList&, const double* x, double q_max, int* index, double* w);
  FieldSums (*predict)(const FieldLayout&, const BlockList&, const double* x, double q_max);
  // A sample to one field. True where another projection is wanted.
  bool (*learn)(const FieldLayout&, const FieldSettings&, double* lane, double* record, double* scratch,
                const double* x, double y, double w);

  // Defined in unit_*.cpp.
  static const UnitOps baseline, avx2, avx512;
};

// Memory that `learn` works in.
inline int scratch_size(const FieldLayout& at) { return 5 * at.row + 2 * at.n * at.n; }

}  // namespace sdftrack
