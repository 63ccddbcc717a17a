// SPDX-License-Identifier: MIT
#include "primitives/energies.h"

namespace sdftrack::primitives {

void PrimitiveSums::add(double value, double slope, double curvature, const double (&J)[P], int n) {
  cost += value;
  int k = 0;
  for (int a = 0; a < n; ++a) {
    gradient[a] += slope * J[a];
    const double weighted = curvature * J[a];
    for (int b = 0; b <= a; ++b, ++k) hessian[k] += weighted * J[b];
  }
}

void PrimitiveSums::add_to(int n, optim::NormalEquations* out) const {
  int k = 0;
  for (int a = 0; a < P; ++a)
    for (int b = 0; b <= a; ++b, ++k) {
      if (a >= n) continue;
      out->hessian(a, b) += hessian[k];
      if (a != b) out->hessian(b, a) += hessian[k];
    }
  for (int a = 0; a < n; ++a) out->gradient[a] += gradient[a];
  out->cost += cost;
}

}  // namespace sdftrack::primitives
