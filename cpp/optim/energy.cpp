// SPDX-License-Identifier: MIT
#include "optim/energy.h"

namespace sdftrack {

void SumEnergy::linearize(const State& x, NormalEquations* out) {
  for (auto& [energy, weight] : terms_) {
    one_.reset(static_cast<int>(out->gradient.size()));
    energy->linearize(x, &one_);
    out->add(one_, weight);
  }
}

double SumEnergy::cost(const State& x) {
  double sum = 0;
  for (auto& [energy, weight] : terms_) sum += weight * energy->cost(x);
  return sum;
}

}  // namespace sdftrack
