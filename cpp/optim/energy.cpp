// SPDX-License-Identifier: MIT
#include "optim/energy.h"

#include <algorithm>

namespace sdftrack::optim {

void SumEnergy::linearize(const State& x, NormalEquations* out) {
  for (auto& [energy, weight] : terms_) {
    one_.reset(int(out->gradient.size()));
    energy->linearize(x, &one_);
    out->add(one_, weight);
  }
}

double SumEnergy::cost(const State& x) {
  double sum = 0;
  for (auto& [energy, weight] : terms_) sum += weight * energy->cost(x);
  return sum;
}

void GroupEnergy::add(Energy* energy, double weight, const int* objects, int count) {
  Term term{energy, weight, {}, count};
  std::copy_n(objects, std::min(std::size_t(count), kMost), term.objects.begin());
  terms_.push_back(term);
}

const State& GroupEnergy::state_of(const Term& term, const State& x) {
  part_.K = x.K;
  part_.T_obj_cam.resize(term.count);
  for (std::size_t k = 0; k < part_.T_obj_cam.size(); ++k) part_.T_obj_cam[k] = x.T_obj_cam[term.objects[k]];
  return part_;
}

void GroupEnergy::linearize(const State& x, NormalEquations* out) {
  for (const Term& term : terms_) {
    NormalEquations& one = one_[term.count - 1];
    one.reset(6 * term.count);
    term.energy->linearize(state_of(term, x), &one);
    out->cost += term.weight * one.cost, out->count += one.count;
    for (int a = 0; a < term.count; ++a) {
      const int to = 6 * term.objects[a];
      out->gradient.segment<6>(to) += term.weight * one.gradient.segment<6>(6 * a);
      for (int b = 0; b < term.count; ++b)
        out->hessian.block<6, 6>(to, 6 * term.objects[b]) +=
            term.weight * one.hessian.block<6, 6>(6 * a, 6 * b);
    }
  }
  for (Energy* energy : whole_) energy->linearize(x, out);
}

double GroupEnergy::cost(const State& x) {
  double sum = 0;
  for (const Term& term : terms_) sum += term.weight * term.energy->cost(state_of(term, x));
  for (Energy* energy : whole_) sum += energy->cost(x);
  return sum;
}

}  // namespace sdftrack::optim
