// SPDX-License-Identifier: MIT
// Loops over the fields of one output, compiled once per instruction set like energies/term_ops.h. All sets
// give bitwise equal results.
#pragma once

#include "base/isa.h"
#include "lwpr/layout.h"

namespace sdftrack::lwpr {

// The fields to evaluate for a sample: 0 to count - 1, or a list in ascending order.
struct FieldList {
  const double* blocks;
  const int* list;  // nullptr: all
  int count;
};

// The fields that a sample activates, in ascending order, and their activations. Needs room for one block
// more than there are fields.
struct ActiveFields {
  int* index;
  double* w;
};

struct FieldSums {
  double w, wy;  // sum of the activations of the fields that are ready; sum of activation times prediction
};

struct UnitOps {
  // Fields with q = -2 log w below q_max. Returns their number.
  int (*active)(const FieldLayout&, const FieldList&, const double* x, double q_max, const ActiveFields&);
  FieldSums (*predict)(const FieldLayout&, const FieldList&, const double* x, double q_max,
                       const ActiveFields&);
  // Adds a sample to the `count` fields that it activates. True if one of them needs another projection.
  bool (*learn)(const FieldLayout&, const FieldSettings&, double* blocks, double* records, long record_stride,
                double* scratch, const double* x, double y, const ActiveFields&, int count);

  // Defined in unit_*.cpp.
  static const UnitOps baseline, avx2, avx512;
};

// Size of the working memory of `learn`.
HD int scratch_size(const FieldLayout& at) { return 5 * at.row + (at.diagonal ? 0 : 2 * at.n * at.n); }

}  // namespace sdftrack::lwpr
