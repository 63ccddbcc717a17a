// SPDX-License-Identifier: MIT
// The rules of Levenberg-Marquardt: when a step is tried, accepted, and the last one. For the host and for
// kernels: no Eigen and no containers here.
#pragma once

#include "base/lane.h"

namespace sdftrack::optim {

struct LmRules {
  int max_steps = 20;         // trials, accepted or not
  double damping = 1e-3;      // start; relative to the diagonal of the Hessian
  double damping_up = 10;     // after a rejected trial
  double damping_down = 0.1;  // after an accepted one
  double damping_min = 1e-9;
  double damping_max = 1e6;  // stop beyond
  double step_m = 1e-6;      // a step below all of these ends the search
  double step_rad = 1e-6;
  double step_relative = 1e-7;  // log scale; intrinsics are compared as fractions of fx
  double cost_relative = 1e-7;  // an accepted trial that lowers the cost by less than this share ends it
  double cost_gain = 0;         // so does a step with a lower gain than this by the quadratic model
  double sure_gain = 0;         // a step with a lower model gain is accepted unevaluated, as the last
  int block = 0;  // unknowns of one object: gains are compared object by object; 0: all together
};

enum class Stop { kSmallStep, kSmallGain, kMaxSteps, kDampingMax, kNotFinite, kNoData };

struct LmStep {
  double cost;  // at the accepted state; for a sure step the model's prediction
  double damping;
  bool accepted;
};

// The gain of a step by the quadratic model: in all, and for the object that gains most.
struct Promise {
  double all, most;
};

// A step that has been computed but not yet judged.
struct LmTrial {
  double promised = 0;
  bool sure = false, small = false;
};

// Damping scales with each unknown's own curvature, so metres, radians and pixels need no common unit.
HD double damping_floor(double most_curved) { return 1e-12 * (most_curved > 1e-300 ? most_curved : 1e-300); }
HD double damped(double curvature, double damping, double floor) {
  return curvature + (damping * (curvature < floor ? floor : curvature) + floor);
}

// A System is at a state that it has linearised, and offers
//   double cost(), count();             at this state
//   bool has_data();                    false: no data to fit
//   bool find_step(double damping);     false: the step is not finite
//   Promise promised();                 gain of that step by the model
//   double look();                      linearises at the step's end; the cost there
//   void accept(bool looked);           moves to the step's end
//   bool step_is_small();
// A Record has cost, count, damping and stop, and keeps the steps: clear_steps(), add(LmStep), trials(). The
// search calls three functions, each false once it has ended: lm_begin, then in turn lm_propose and, with the
// cost at the step's end, lm_judge. The caller may evaluate in between, as in a kernel of many threads.
template <class System, class Record>
HD bool lm_begin(const System& system, const LmRules& rules, Record* out) {
  out->damping = rules.damping, out->stop = Stop::kMaxSteps, out->clear_steps();
  out->cost = system.cost(), out->count = system.count();
  if (system.has_data()) return true;
  out->stop = Stop::kNoData;
  return false;
}

template <class System, class Record>
HD bool lm_propose(System& system, const LmRules& rules, Record* out, LmTrial* trial) {
  if (out->trials() >= rules.max_steps) return false;
  if (!system.find_step(out->damping)) {
    out->stop = Stop::kNotFinite;
    return false;
  }
  const Promise promise = system.promised();
  if (promise.most < rules.cost_gain) {
    out->stop = Stop::kSmallGain;
    return false;
  }
  *trial = {promise.all, promise.most < rules.sure_gain, system.step_is_small()};
  return true;
}

template <class System, class Record>
HD bool lm_judge(System& system, const LmRules& rules, const LmTrial& trial, double trial_cost, Record* out) {
  const double cost = out->cost, used = out->damping;
  const bool accepted = trial_cost < cost;
  bool little_gain = trial.sure;
  if (accepted) {
    system.accept(!trial.sure);
    little_gain = little_gain || cost - trial_cost < rules.cost_relative * abs(cost);
    out->cost = trial_cost;
    const double less = out->damping * rules.damping_down;
    out->damping = rules.damping_min < less ? less : rules.damping_min;
  } else {
    out->damping *= rules.damping_up;
  }
  out->add({out->cost, used, accepted});
  if (trial.small || little_gain) {
    out->stop = trial.small ? Stop::kSmallStep : Stop::kSmallGain;
    return false;
  }
  if (out->damping > rules.damping_max) {
    out->stop = Stop::kDampingMax;
    return false;
  }
  return true;
}

// Advances to the next trial that needs an evaluation; false: the search has ended.
template <class System, class Record>
HD bool lm_go_on(System& system, const LmRules& rules, Record* out, LmTrial* trial) {
  while (lm_propose(system, rules, out, trial)) {
    if (!trial->sure) return true;
    if (!lm_judge(system, rules, *trial, out->cost - trial->promised, out)) return false;
  }
  return false;
}

}  // namespace sdftrack::optim
