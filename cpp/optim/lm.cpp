// SPDX-License-Identifier: MIT
#include "optim/lm.h"

#include <Eigen/SparseCholesky>
#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

#include "optim/lm_loop.h"

namespace sdftrack::optim {

namespace {

constexpr Eigen::Index kDense = 48;  // up to this number of unknowns a dense factorisation is faster

void find_free_unknowns(const LmOptions& options, int n, std::vector<int>* free) {
  if (!options.fixed.empty() && int(options.fixed.size()) != n)
    throw std::invalid_argument("fixed: expected one entry per unknown (" + std::to_string(n) + "), got " +
                                std::to_string(options.fixed.size()));
  free->clear();
  for (int i = 0; i < n; ++i)
    if (options.fixed.empty() || !options.fixed[i]) free->push_back(i);
}

// work->delta: the damped step over the free unknowns, 0 elsewhere.
void find_damped_step(const NormalEquations& eq, double damping, LmWork* work) {
  const std::vector<int>& free = work->free;
  const auto n = static_cast<Eigen::Index>(free.size());
  Eigen::MatrixXd& A = work->A;
  A.resize(n, n), work->rhs.resize(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const int row = free[i];
    work->rhs[i] = -eq.gradient[row];
    for (Eigen::Index j = 0; j < n; ++j) A(i, j) = eq.hessian(row, free[j]);
  }
  damp(damping, &A);
  if (n <= kDense) {
    work->factor.compute(A);
    work->rhs = work->factor.solve(work->rhs);
  } else {
    // Among many objects only those in contact are coupled: most blocks are empty.
    const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> factor(A.sparseView());
    work->rhs = factor.solve(work->rhs);
  }
  work->delta.setZero(eq.gradient.size());
  for (Eigen::Index i = 0; i < n; ++i) work->delta[free[i]] = work->rhs[i];
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

// The largest gain for one object: the gain of one moving object must not vanish among many at rest.
double max_promised(const NormalEquations& eq, const LmWork& work, int block) {
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

namespace {

// An energy with a dense Hessian. Each trial is linearised at once: most are accepted, and the next step then
// needs no further evaluation.
class DenseSystem {
 public:
  DenseSystem(Energy& energy, const LmOptions& options, State* x, LmWork* work)
      : energy_(energy), options_(options), unknowns_(energy.unknowns()), x_(x), work_(work) {
    find_free_unknowns(options, unknowns_.size(), &work->free);
    linearize(*x, &work->here);
  }
  double cost() const { return work_->here.cost; }
  double count() const { return work_->here.count; }
  bool has_data() const { return work_->here.hessian.diagonal().maxCoeff() > 0 && !work_->free.empty(); }
  bool find_step(double damping) {
    find_damped_step(work_->here, damping, work_);
    return work_->delta.allFinite();
  }
  Promise promised() {
    const NormalEquations& eq = work_->here;
    work_->curved.noalias() = eq.hessian * work_->delta;
    const double all = -(eq.gradient.dot(work_->delta) + 0.5 * work_->delta.dot(work_->curved));
    return {all, options_.block > 0 ? max_promised(eq, *work_, options_.block) : all};
  }
  double look() {
    move();
    linearize(work_->trial, &work_->next);
    return work_->next.cost;
  }
  void accept(bool looked) {
    if (!looked) move();
    std::swap(*x_, work_->trial);
    if (looked) std::swap(work_->here, work_->next);
  }
  bool step_is_small() const { return is_small(work_->delta, unknowns_, *x_, options_); }

 private:
  void move() { retract(unknowns_, *x_, work_->delta, &work_->trial); }
  void linearize(const State& x, NormalEquations* to) {
    to->reset(unknowns_.size());
    energy_.linearize(x, to);
  }

  Energy& energy_;
  const LmOptions& options_;
  const Unknowns unknowns_;
  State* x_;
  LmWork* work_;
};

}  // namespace

void minimize(Energy& energy, const LmOptions& options, LmWork* work, LmResult* out) {
  DenseSystem system(energy, options, &out->x, work);
  run_lm(system, options, out);
}

LmResult minimize(Energy& energy, const State& start, const LmOptions& options) {
  LmWork work;
  LmResult out;
  out.x = start;
  minimize(energy, options, &work, &out);
  return out;
}

}  // namespace sdftrack::optim
