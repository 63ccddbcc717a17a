// SPDX-License-Identifier: MIT
// Normal equations of many poses that are coupled only through a few shared unknowns: an arrow of blocks. The
// poses are eliminated one by one, so that a step's cost is linear in their number, not cubic.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "optim/lm_loop.h"

namespace sdftrack::optim {

using Vector6d = Eigen::Matrix<double, 6, 1>;

constexpr int kMaxShared = 9;
using SharedVector = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, kMaxShared, 1>;
using SharedMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, kMaxShared, kMaxShared>;
using CrossMatrix = Eigen::Matrix<double, 6, Eigen::Dynamic, 0, 6, kMaxShared>;

// The contribution of one pose to the normal equations.
struct ArrowBlock {
  Eigen::Matrix<double, 6, 6> pose;  // second derivatives by the pose,
  CrossMatrix cross;                 // by the pose and the shared unknowns,
  SharedMatrix shared;               // by the shared unknowns
  Vector6d pose_gradient;
  SharedVector shared_gradient;
  double cost = 0, count = 0;

  void reset(int shared_unknowns);
};

// The energy to be minimised: a sum over poses, and a prior on the shared unknowns.
class ArrowEnergy {
 public:
  virtual ~ArrowEnergy() = default;
  virtual int shared_unknowns() const = 0;
  // One block for each pose, at the current state or (trial) at the state that a step has led to.
  virtual void linearize(bool trial, std::vector<ArrowBlock>* blocks, ArrowBlock* prior) = 0;
  virtual void retract(const std::vector<Vector6d>& poses,
                       const SharedVector& shared) = 0;  // makes the trial
  virtual void accept() = 0;                             // the trial becomes the state
  virtual bool is_small(const std::vector<Vector6d>& poses, const SharedVector& shared) const = 0;
};

void minimize(ArrowEnergy& energy, const LmOptions& options, LmRecord* out);

}  // namespace sdftrack::optim
