// SPDX-License-Identifier: MIT
// Which kind a view shows: the cost of each kind's fit, where measurements with a common error count once.
// docs/math/primitives.md, section 6.
#pragma once

#include <vector>

#include "primitives/fit.h"

namespace sdftrack::primitives {

struct KindEvidence {
  double against = 0;    // nats: half of the Bayesian information criterion, k ln n - 2 ln L
  double effective = 0;  // effective number of independent measurements; the same for all kinds
};

// The area (px^2) over which residuals are correlated: 1 where they are not, and for a view without an image.
double correlated_px2(const PrimitiveFit& fit, const PrimitiveView& view, const PrimitiveFitOptions& options);

// One for each fit; empty for fits that were not found.
std::vector<KindEvidence> compare_kinds(const std::vector<PrimitiveFit>& fits, const PrimitiveView& view,
                                        const PrimitiveFitOptions& options, int threads);

}  // namespace sdftrack::primitives
