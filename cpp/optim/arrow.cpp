// SPDX-License-Identifier: MIT
#include "optim/arrow.h"

#include <utility>

#include "optim/dense.h"

namespace sdftrack::optim {

namespace {

using Matrix6d = Eigen::Matrix<double, 6, 6>;

class ArrowSystem {
 public:
  explicit ArrowSystem(ArrowEnergy& energy) : energy_(energy) { linearize(false, &here_); }

  double cost() const { return here_.cost; }
  double count() const { return here_.count; }
  bool has_data() const { return here_.count > 0; }

  bool find_step(double damping) {
    const int n = energy_.shared_unknowns();
    SharedMatrix A = here_.prior.shared;
    SharedVector g = here_.prior.shared_gradient;
    for (const ArrowBlock& block : here_.blocks) A += block.shared, g += block.shared_gradient;
    if (n > 0) damp(damping, &A);
    const std::size_t m = here_.blocks.size();
    solved_.resize(m), poses_.resize(m);
    for (std::size_t i = 0; i < m; ++i) {
      const ArrowBlock& block = here_.blocks[i];
      Matrix6d pose = block.pose;
      damp(damping, &pose);
      solved_[i] = {solve_symmetric<6, Eigen::Dynamic>(pose, block.cross),
                    solve_symmetric<6, 1>(pose, block.pose_gradient)};
      A -= block.cross.transpose() * solved_[i].cross;
      g -= block.cross.transpose() * solved_[i].gradient;
    }
    shared_ = SharedVector::Zero(n);
    if (n > 0) shared_ = -solve_symmetric<Eigen::Dynamic, 1>(A, g);
    bool finite = shared_.allFinite();
    for (std::size_t i = 0; i < m; ++i) {
      poses_[i] = -solved_[i].gradient - solved_[i].cross * shared_;
      finite &= poses_[i].allFinite();
    }
    return finite;
  }

  Promise promised() const {
    double all = -gain_of(here_.prior, Vector6d::Zero());
    for (std::size_t i = 0; i < poses_.size(); ++i) all -= gain_of(here_.blocks[i], poses_[i]);
    return {all, all};
  }
  double look() {
    energy_.retract(poses_, shared_);
    linearize(true, &next_);
    return next_.cost;
  }
  void accept(bool looked) {
    if (!looked) energy_.retract(poses_, shared_);
    energy_.accept();
    if (looked) std::swap(here_, next_);
  }
  bool step_is_small() const { return energy_.is_small(poses_, shared_); }

 private:
  struct Linearized {
    std::vector<ArrowBlock> blocks;
    ArrowBlock prior;
    double cost = 0, count = 0;
  };
  struct Solved {
    CrossMatrix cross;
    Vector6d gradient;
  };

  // Change of a block's quadratic model by the step.
  double gain_of(const ArrowBlock& block, const Vector6d& pose) const {
    const double linear = block.pose_gradient.dot(pose) + block.shared_gradient.dot(shared_);
    const double bent = pose.dot(block.pose * pose) + 2 * pose.dot(block.cross * shared_) +
                        shared_.dot(block.shared * shared_);
    return linear + 0.5 * bent;
  }

  void linearize(bool trial, Linearized* to) {
    to->prior.reset(energy_.shared_unknowns());
    energy_.linearize(trial, &to->blocks, &to->prior);
    to->cost = to->prior.cost, to->count = 0;
    for (const ArrowBlock& block : to->blocks) to->cost += block.cost, to->count += block.count;
  }

  ArrowEnergy& energy_;
  Linearized here_, next_;
  std::vector<Solved> solved_;
  std::vector<Vector6d> poses_;
  SharedVector shared_;
};

}  // namespace

void ArrowBlock::reset(int n) {
  pose.setZero(), pose_gradient.setZero();
  cross.setZero(6, n), shared.setZero(n, n), shared_gradient.setZero(n);
  cost = count = 0;
}

void minimize(ArrowEnergy& energy, const LmOptions& options, LmRecord* out) {
  ArrowSystem system(energy);
  run_lm(system, options, out);
}

}  // namespace sdftrack::optim
