// SPDX-License-Identifier: MIT
// The loop of Levenberg-Marquardt, over whatever holds the unknowns and solves for a step.
#pragma once

#include <algorithm>
#include <cmath>

#include "optim/lm.h"

namespace sdftrack::optim {

// Damping scales with each unknown's own curvature, so metres, radians and pixels need no common unit.
template <class Matrix>
void damp(double damping, Matrix* A) {
  const double floor = 1e-12 * std::max(1e-300, A->diagonal().maxCoeff());
  for (auto i = A->rows(); i-- > 0;) (*A)(i, i) += damping * std::max((*A)(i, i), floor) + floor;
}

// What a step promises by the quadratic model: in all, and for the one object that gains most.
struct Promise {
  double all, most;
};

// A System is at a state that it has linearised, and offers
//   double cost(), count();             there
//   bool has_data();                    false: nothing to go by
//   bool find_step(double damping);     false: the step is not finite
//   Promise promised();                 of that step
//   double look();                      linearises at the step's end; the cost there
//   void accept(bool looked);           goes there
//   bool step_is_small();
template <class System>
void run_lm(System& system, const LmOptions& options, LmRecord* out) {
  out->damping = options.damping, out->stop = Stop::kMaxSteps, out->steps.clear();
  out->cost = system.cost(), out->count = system.count();
  if (!system.has_data()) {
    out->stop = Stop::kNoData;
    return;
  }
  for (int step = 0; step < options.max_steps; ++step) {
    if (!system.find_step(out->damping)) {
      out->stop = Stop::kNotFinite;
      return;
    }
    const Promise promise = system.promised();
    if (promise.most < options.cost_gain) {
      out->stop = Stop::kSmallGain;
      return;
    }
    const double cost = out->cost, used = out->damping;
    const bool sure = promise.most < options.sure_gain, small = system.step_is_small();
    const double trial_cost = sure ? cost - promise.all : system.look();
    const bool accepted = trial_cost < cost;
    bool little_gain = sure;
    if (accepted) {
      system.accept(!sure);
      little_gain |= cost - trial_cost < options.cost_relative * std::abs(cost);
      out->cost = trial_cost;
      out->damping = std::max(options.damping_min, out->damping * options.damping_down);
    } else {
      out->damping *= options.damping_up;
    }
    out->steps.push_back({out->cost, used, accepted});
    if (small || little_gain) {
      out->stop = small ? Stop::kSmallStep : Stop::kSmallGain;
      return;
    }
    if (out->damping > options.damping_max) {
      out->stop = Stop::kDampingMax;
      return;
    }
  }
}

}  // namespace sdftrack::optim
