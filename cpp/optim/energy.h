// SPDX-License-Identifier: MIT
// What the optimiser sees of an energy: a cost to be minimised and its quadratic model.
#pragma once

#include <utility>
#include <vector>

#include "optim/normal_equations.h"
#include "optim/parameters.h"

namespace sdftrack {

// An energy says what a state costs and how the cost changes; it never loops over a damping.
// linearize() and cost() visit the same pixels with the same penalty, so that they may be compared. An energy
// may keep a warm start for its inner problem (where each pixel's ray meets the model) from state to state.
class Energy {
 public:
  virtual ~Energy() = default;
  virtual Unknowns unknowns() const = 0;
  virtual void linearize(const State& x, NormalEquations* out) = 0;  // adds to *out
  virtual double cost(const State& x) = 0;
};

// sum_i weight_i E_i over the same unknowns; priors are energies too.
class SumEnergy final : public Energy {
 public:
  void clear() { terms_.clear(); }
  void add(Energy* energy, double weight = 1.0) { terms_.push_back({energy, weight}); }

  Unknowns unknowns() const override { return terms_.front().first->unknowns(); }
  void linearize(const State& x, NormalEquations* out) override;
  double cost(const State& x) override;

 private:
  std::vector<std::pair<Energy*, double>> terms_;
  NormalEquations one_;
};

}  // namespace sdftrack
