// SPDX-License-Identifier: MIT
// The loop of Levenberg-Marquardt, over any System that holds the unknowns and solves for a step.
#pragma once

#include "optim/lm.h"

namespace sdftrack::optim {

template <class Matrix>
void damp(double damping, Matrix* A) {
  const double floor = damping_floor(A->diagonal().maxCoeff());
  for (auto i = A->rows(); i-- > 0;) (*A)(i, i) = damped((*A)(i, i), damping, floor);
}

template <class System>
void run_lm(System& system, const LmRules& rules, LmRecord* out) {
  LmTrial trial;
  if (!lm_begin(system, rules, out)) return;
  while (lm_go_on(system, rules, out, &trial))
    if (!lm_judge(system, rules, trial, system.look(), out)) return;
}

}  // namespace sdftrack::optim
