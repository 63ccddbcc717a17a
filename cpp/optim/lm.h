// SPDX-License-Identifier: MIT
// Levenberg-Marquardt: the one optimiser of this library.
#pragma once

#include <Eigen/Cholesky>
#include <vector>

#include "optim/energy.h"

namespace sdftrack::optim {

struct LmOptions {
  int max_steps = 20;         // trials, accepted or not
  double damping = 1e-3;      // start; relative to the diagonal of the Hessian
  double damping_up = 10;     // after a rejected trial
  double damping_down = 0.1;  // after an accepted one
  double damping_min = 1e-9;
  double damping_max = 1e6;  // stop beyond
  double step_m = 1e-6;      // a step below all of these ends the search
  double step_rad = 1e-6;
  double step_relative = 1e-7;  // log scale; intrinsics are compared as fractions of fx
  double cost_relative = 1e-7;  // an accepted trial that gains less than this share of the cost ends it
  double cost_gain = 0;         // so does a step that promises less than this: the quadratic model's own gain
  double sure_gain = 0;         // a step that promises less than this is kept without a look, and is the last
  int block = 0;  // unknowns of one object, whose gains are then compared one by one; 0: all together
  std::vector<bool> fixed;  // unknowns to leave alone (empty: none); taken out of the system
};

enum class Stop { kSmallStep, kSmallGain, kMaxSteps, kDampingMax, kNotFinite, kNoData };
const char* stop_name(Stop stop);

struct LmStep {
  double cost;  // at the state that was kept; of a sure step what the model promises
  double damping;
  bool accepted;
};

// How a search went.
struct LmRecord {
  double cost = 0;
  double count = 0;
  double damping = 0;  // to go on with
  Stop stop = Stop::kMaxSteps;
  std::vector<LmStep> steps;
};

struct LmResult : LmRecord {
  State x;
};

// Working memory: whoever minimises in every frame keeps it, and nothing is allocated from the second on.
struct LmWork {
  NormalEquations here, next;
  State trial;
  std::vector<int> free;
  Eigen::MatrixXd A;
  Eigen::VectorXd rhs, delta, curved;
  Eigen::LDLT<Eigen::MatrixXd> factor;
};

// From out->x on; its steps are overwritten.
void minimize(Energy& energy, const LmOptions& options, LmWork* work, LmResult* out);
LmResult minimize(Energy& energy, const State& start, const LmOptions& options);

}  // namespace sdftrack::optim
