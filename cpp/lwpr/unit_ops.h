// SPDX-License-Identifier: MIT
// Loops over the fields of one output, compiled once per instruction set like energies/term_ops.h. All sets
// give the same bits.
#pragma once

#include "base/isa.h"
#include "lwpr/layout.h"

namespace sdftrack::lwpr {

// The fields that a sample looks at: 0 to count - 1, or a list in ascending order.
struct FieldList {
  const double* blocks;
  const int* list;  // nullptr: all
  int count;
};

// The fields that a sample activates, in ascending order, and how much. Room for a whole block more than
// there are fields.
struct ActiveFields {
  int* index;
  double* w;
};

struct FieldSums {
  double w, wy;  // of the activations of the fields that are ready, and times what they say
};

struct UnitOps {
  // Fields with q = -2 log w below q_max. Returns how many there are.
  int (*active)(const FieldLayout&, const FieldList&, const double* x, double q_max, const ActiveFields&);
  FieldSums (*predict)(const FieldLayout&, const FieldList&, const double* x, double q_max,
                       const ActiveFields&);
  // A sample to the `count` fields that it activates. True where one of them wants another projection.
  bool (*learn)(const FieldLayout&, const FieldSettings&, double* blocks, double* records, long record_stride,
                double* scratch, const double* x, double y, const ActiveFields&, int count);

  // Defined in unit_*.cpp.
  static const UnitOps baseline, avx2, avx512;
};

// Memory that `learn` works in.
HD int scratch_size(const FieldLayout& at) { return 5 * at.row + (at.diagonal ? 0 : 2 * at.n * at.n); }

}  // namespace sdftrack::lwpr
