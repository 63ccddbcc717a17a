// SPDX-License-Identifier: MIT
// Which kind a view shows: what each kind's fit costs, with readings that err alike counted once.
// docs/math/primitives.md, section 6.
#pragma once

#include <vector>

#include "primitives/fit.h"

namespace sdftrack::primitives {

struct KindEvidence {
  double against = 0;    // nats; half of it is a Bayesian information criterion's -2 log likelihood
  double effective = 0;  // readings that count as independent; the same for all kinds
};

// Pixels whose residuals are alike, as an area: 1 where none are. Of a view without an image, 1.
double correlated_px2(const PrimitiveFit& fit, const PrimitiveView& view, const PrimitiveFitOptions& options);

// One for each fit; of those not found nothing.
std::vector<KindEvidence> compare_kinds(const std::vector<PrimitiveFit>& fits, const PrimitiveView& view,
                                        const PrimitiveFitOptions& options, int threads);

}  // namespace sdftrack::primitives
