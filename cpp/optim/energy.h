// SPDX-License-Identifier: MIT
// The optimiser's interface to an energy: a cost to be minimised and its quadratic model.
#pragma once

#include <array>
#include <utility>
#include <vector>

#include "optim/normal_equations.h"
#include "optim/parameters.h"

namespace sdftrack::optim {

// An energy evaluates the cost of a state and its derivatives; it never loops over a damping. linearize() and
// cost() visit the same pixels with the same penalty, so that their costs may be compared. An energy may keep
// a warm start for its inner problem (where each pixel's ray meets the model) from state to state.
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

// sum_i weight_i E_i over several objects, where each term depends on a few: its object k is objects[k] of
// the whole. The cost of a linearisation grows with the terms, not with the square of all unknowns.
class GroupEnergy final : public Energy {
 public:
  static constexpr std::size_t kMost = 4;  // objects of a term

  void clear(int objects) {
    objects_ = objects, terms_.clear();
    whole_.clear();
  }
  // At most kMost objects.
  void add(Energy* energy, double weight, const int* objects, int count);
  // A term that depends on all objects, in their order.
  void add(Energy* energy) { whole_.push_back(energy); }

  Unknowns unknowns() const override { return {objects_, false, false}; }
  void linearize(const State& x, NormalEquations* out) override;
  double cost(const State& x) override;

 private:
  struct Term {
    Energy* energy;
    double weight;
    std::array<int, kMost> objects;
    int count;
  };
  const State& state_of(const Term& term, const State& x);

  int objects_ = 0;
  std::vector<Term> terms_;
  std::vector<Energy*> whole_;
  State part_;
  std::array<NormalEquations, kMost> one_;  // one for each number of objects of a term: their sizes stay
};

}  // namespace sdftrack::optim
