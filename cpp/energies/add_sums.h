// SPDX-License-Identifier: MIT
// Adds the sums of a loop to the optimiser's normal equations.
#pragma once

#include "energies/term.h"
#include "optim/normal_equations.h"

namespace sdftrack::energies {

template <int P>
void add_to(const Sums<double, P>& sums, optim::NormalEquations* out) {
  int k = 0;
  for (int a = 0; a < P; ++a) {
    out->gradient[a] += sums.gradient[a];
    for (int b = 0; b <= a; ++b, ++k) {
      out->hessian(a, b) += sums.hessian[k];
      if (a != b) out->hessian(b, a) += sums.hessian[k];
    }
  }
  out->cost += sums.cost;
  out->count += sums.count;
}

}  // namespace sdftrack::energies
