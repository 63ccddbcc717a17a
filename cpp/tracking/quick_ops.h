// SPDX-License-Identifier: MIT
// The sums of a rough fit, compiled once per instruction set like energies/term_ops.h.
#pragma once

#include "base/isa.h"
#include "tracking/quick_terms.h"

namespace sdftrack {

// All that is summed at one pose. A list without points is left out.
struct QuickTerms {
  ReadingTerm<float> readings, solids;
  SurfaceTerm<float> surface;
  OutlineTerm<float> outline;
};

struct QuickCost {
  double readings = 0, surface = 0, outline = 0;
  double surface_points = 0;  // that have a reading
};

struct QuickOps {
  Sums<double, 6> (*linearize)(const QuickTerms&);  // without the cost
  QuickCost (*cost)(const QuickTerms&);

  // Defined in quick_*.cpp.
  static const QuickOps baseline, avx2, avx512;
};

inline const QuickOps& quick_ops_for(Isa isa) {
#ifdef SDFTRACK_X86_SETS
  if (isa == Isa::kAvx512) return QuickOps::avx512;
  if (isa == Isa::kAvx2) return QuickOps::avx2;
#endif
  static_cast<void>(isa);
  return QuickOps::baseline;
}

}  // namespace sdftrack
