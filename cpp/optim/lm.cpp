// SPDX-License-Identifier: MIT
#include "optim/lm.h"

#include <Eigen/SparseCholesky>
#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

namespace sdftrack {

namespace {

constexpr Eigen::Index kDense = 48;  // unknowns up to which a dense factorisation is the faster one

void find_free_unknowns(const LmOptions& options, int n, std::vector<int>* free) {
  if (!options.fixed.empty() && static_cast<int>(options.fixed.size()) != n)
    throw std::invalid_argument("fixed: expected one entry per unknown (" + std::to_string(n) + "), got " +
                                std::to_string(options.fixed.size()));
  free->clear();
  for (int i = 0; i < n; ++i)
    if (options.fixed.empty() || !options.fixed[static_cast<std::size_t>(i)]) free->push_back(i);
}

// work->delta: the damped step over the free unknowns, 0 elsewhere. Damping scales with each unknown's own
// curvature, so metres, radians and pixels need no common unit.
void find_damped_step(const NormalEquations& eq, double damping, LmWork* work) {
  const std::vector<int>& free = work->free;
  const auto n = static_cast<Eigen::Index>(free.size());
  Eigen::MatrixXd& A = work->A;
  A.resize(n, n), work->rhs.resize(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const int row = free[static_cast<std::size_t>(i)];
    work->rhs[i] = -eq.gradient[row];
    for (Eigen::Index j = 0; j < n; ++j) A(i, j) = eq.hessian(row, free[static_cast<std::size_t>(j)]);
  }
  const double floor = 1e-12 * std::max(1e-300, A.diagonal().maxCoeff());
  for (Eigen::Index i = 0; i < n; ++i) A(i, i) += damping * std::max(A(i, i), floor) + floor;
  if (n <= kDense) {
    work->factor.compute(A);
    work->rhs = work->factor.solve(work->rhs);
  } else {
    // Of many objects only those that touch share anything: most blocks are empty.
    const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> factor(A.sparseView());
    work->rhs = factor.solve(work->rhs);
  }
  work->delta.setZero(eq.gradient.size());
  for (Eigen::Index i = 0; i < n; ++i) work->delta[free[static_cast<std::size_t>(i)]] = work->rhs[i];
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

// The most that the step promises for one object: beside many that stand still one that moves must not drown.
double most_promised(const NormalEquations& eq, const LmWork& work, int block) {
  double most = 0;
  for (Eigen::Index i = 0; i + block <= work.delta.size(); i += block) {
    const auto delta = work.delta.segment(i, block);
    most = std::max(
        most, -(eq.gradient.segment(i, block).dot(delta) + 0.5 * delta.dot(work.curved.segment(i, block))));
  }
  return most;
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

void minimize(Energy& energy, const LmOptions& options, LmWork* work, LmResult* out) {
  const Unknowns unknowns = energy.unknowns();
  find_free_unknowns(options, unknowns.size(), &work->free);
  out->damping = options.damping, out->stop = Stop::kMaxSteps, out->steps.clear();

  // A trial is linearised at once: most are kept, and then the next step needs no other look.
  NormalEquations &eq = work->here, &next = work->next;
  const auto look = [&](const State& x, NormalEquations* to) {
    to->reset(unknowns.size());
    energy.linearize(x, to);
  };
  look(out->x, &eq);
  out->cost = eq.cost, out->count = eq.count;
  if (!(eq.hessian.diagonal().maxCoeff() > 0) || work->free.empty()) {
    out->stop = Stop::kNoData;
    return;
  }
  const Eigen::VectorXd& delta = work->delta;
  for (int step = 0; step < options.max_steps; ++step) {
    find_damped_step(eq, out->damping, work);
    if (!delta.allFinite()) {
      out->stop = Stop::kNotFinite;
      return;
    }
    work->curved.noalias() = eq.hessian * delta;
    const double promised = -(eq.gradient.dot(delta) + 0.5 * delta.dot(work->curved));
    const double most = options.block > 0 ? most_promised(eq, *work, options.block) : promised;
    if (most < options.cost_gain) {
      out->stop = Stop::kSmallGain;
      return;
    }
    retract(unknowns, out->x, delta, &work->trial);
    const bool sure = most < options.sure_gain;
    if (!sure) look(work->trial, &next);
    const double trial_cost = sure ? eq.cost - promised : next.cost;
    const bool accepted = trial_cost < eq.cost;
    const bool small = is_small(delta, unknowns, out->x, options);
    const double used = out->damping;
    bool little_gain = sure;
    if (accepted) {
      std::swap(out->x, work->trial);
      little_gain |= eq.cost - trial_cost < options.cost_relative * std::abs(eq.cost);
      out->cost = trial_cost;
      out->damping = std::max(options.damping_min, out->damping * options.damping_down);
      if (!sure) std::swap(eq, next);
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

LmResult minimize(Energy& energy, const State& start, const LmOptions& options) {
  LmWork work;
  LmResult out;
  out.x = start;
  minimize(energy, options, &work, &out);
  return out;
}

}  // namespace sdftrack
