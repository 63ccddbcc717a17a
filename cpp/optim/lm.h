// SPDX-License-Identifier: MIT
// Levenberg-Marquardt: the one optimiser of this library.
#pragma once

#include <Eigen/Cholesky>
#include <vector>

#include "optim/energy.h"
#include "optim/lm_rules.h"

namespace sdftrack::optim {

struct LmOptions : LmRules {
  std::vector<bool> fixed;  // unknowns that are kept fixed (empty: none); taken out of the system
};

const char* stop_name(Stop stop);

// The course and result of a search.
struct LmRecord {
  double cost = 0;
  double count = 0;
  double damping = 0;  // to continue with
  Stop stop = Stop::kMaxSteps;
  std::vector<LmStep> steps;

  void clear_steps() { steps.clear(); }
  void add(const LmStep& step) { steps.push_back(step); }
  int trials() const { return int(steps.size()); }
};

struct LmResult : LmRecord {
  State x;
};

// Working memory: a caller that minimises in every frame keeps it, so that only the first call allocates.
struct LmWork {
  NormalEquations here, next;
  State trial;
  std::vector<int> free;
  Eigen::MatrixXd A;
  Eigen::VectorXd rhs, delta, curved;
  Eigen::LDLT<Eigen::MatrixXd> factor;
};

// Starts from out->x; its steps are overwritten.
void minimize(Energy& energy, const LmOptions& options, LmWork* work, LmResult* out);
LmResult minimize(Energy& energy, const State& start, const LmOptions& options);

}  // namespace sdftrack::optim
