// SPDX-License-Identifier: MIT
#include "optim/lm.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

namespace sdftrack {

namespace {

std::vector<int> free_unknowns(const LmOptions& options, int n) {
  if (!options.fixed.empty() && static_cast<int>(options.fixed.size()) != n)
    throw std::invalid_argument("fixed: expected one entry per unknown (" + std::to_string(n) + "), got " +
                                std::to_string(options.fixed.size()));
  std::vector<int> free;
  for (int i = 0; i < n; ++i)
    if (options.fixed.empty() || !options.fixed[static_cast<std::size_t>(i)]) free.push_back(i);
  return free;
}

// The damped step over the free unknowns, 0 elsewhere. Damping scales with each unknown's own curvature,
// so metres, radians and pixels need no common unit.
Eigen::VectorXd damped_step(const NormalEquations& eq, const std::vector<int>& free, double damping) {
  Eigen::MatrixXd A = eq.hessian(free, free);
  const double floor = 1e-12 * std::max(1e-300, A.diagonal().maxCoeff());
  A.diagonal() += damping * A.diagonal().cwiseMax(floor) + Eigen::VectorXd::Constant(A.rows(), floor);
  Eigen::VectorXd delta = Eigen::VectorXd::Zero(eq.gradient.size());
  const Eigen::VectorXd downhill = -eq.gradient(free);
  const Eigen::VectorXd step = A.ldlt().solve(downhill);
  delta(free) = step;
  return delta;
}

bool is_small(const Eigen::VectorXd& delta, const Unknowns& unknowns, const State& x,
              const LmOptions& options) {
  for (int i = 0; i < delta.size(); ++i) {
    double limit = options.step_m;
    switch (unit_of(unknowns, i)) {
      case Unit::kMetre:
        break;
      case Unit::kRadian:
        limit = options.step_rad;
        break;
      case Unit::kLogScale:
        limit = options.step_relative;
        break;
      case Unit::kPixel:
        limit = options.step_relative * x.K.fx;
        break;
    }
    if (std::abs(delta[i]) > limit) return false;
  }
  return true;
}

}  // namespace

const char* stop_name(Stop stop) {
  switch (stop) {
    case Stop::kSmallStep:
      return "small_step";
    case Stop::kSmallGain:
      return "small_gain";
    case Stop::kMaxSteps:
      return "max_steps";
    case Stop::kDampingMax:
      return "damping_max";
    case Stop::kNotFinite:
      return "not_finite";
    case Stop::kNoData:
      return "no_data";
  }
  return "unknown";
}

LmResult minimize(Energy& energy, const State& start, const LmOptions& options) {
  const Unknowns unknowns = energy.unknowns();
  const std::vector<int> free = free_unknowns(options, unknowns.size());
  LmResult out{start, 0, 0, options.damping, Stop::kMaxSteps, {}};
  out.steps.reserve(static_cast<std::size_t>(options.max_steps));

  // A trial is linearised at once: most are kept, and then the next step needs no other look.
  NormalEquations eq, next;
  const auto look = [&](const State& x, NormalEquations* to) {
    to->reset(unknowns.size());
    energy.linearize(x, to);
  };
  look(start, &eq);
  out.cost = eq.cost, out.count = eq.count;
  if (!(eq.hessian.diagonal().maxCoeff() > 0) || free.empty()) {
    out.stop = Stop::kNoData;
    return out;
  }
  for (int step = 0; step < options.max_steps; ++step) {
    const Eigen::VectorXd delta = damped_step(eq, free, out.damping);
    if (!delta.allFinite()) {
      out.stop = Stop::kNotFinite;
      break;
    }
    const double promised = -(eq.gradient.dot(delta) + 0.5 * delta.dot(eq.hessian * delta));
    if (promised < options.cost_gain) {
      out.stop = Stop::kSmallGain;
      break;
    }
    State trial = retract(unknowns, out.x, delta);
    const bool sure = promised < options.sure_gain;
    if (!sure) look(trial, &next);
    const double trial_cost = sure ? eq.cost - promised : next.cost;
    const bool accepted = trial_cost < eq.cost;
    const bool small = is_small(delta, unknowns, out.x, options);
    const double used = out.damping;
    bool little_gain = sure;
    if (accepted) {
      out.x = std::move(trial);
      little_gain |= eq.cost - trial_cost < options.cost_relative * std::abs(eq.cost);
      out.cost = trial_cost;
      out.damping = std::max(options.damping_min, out.damping * options.damping_down);
      if (!sure) std::swap(eq, next);
    } else {
      out.damping *= options.damping_up;
    }
    out.steps.push_back({out.cost, used, accepted});
    if (small || little_gain) {
      out.stop = small ? Stop::kSmallStep : Stop::kSmallGain;
      break;
    }
    if (out.damping > options.damping_max) {
      out.stop = Stop::kDampingMax;
      break;
    }
  }
  return out;
}

}  // namespace sdftrack
