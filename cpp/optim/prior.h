// SPDX-License-Identifier: MIT
// A Gaussian prior on one object's pose: holds the directions that the data leave free.
#pragma once

#include "optim/energy.h"

namespace sdftrack {

// E = |v|^2 / (2 sigma_m^2) + |w|^2 / (2 sigma_rad^2), where (v, w) is the increment that takes the prior
// pose to x: T_obj_cam = increment(v, w) T_prior, w = 4 MRP.
class PosePrior final : public Energy {
 public:
  PosePrior(Unknowns unknowns, int object, const Rigidd& T_obj_cam, double sigma_m, double sigma_rad)
      : unknowns_(unknowns), object_(object), T_prior_(T_obj_cam), sigma_m_(sigma_m), sigma_rad_(sigma_rad) {}

  Unknowns unknowns() const override { return unknowns_; }
  void linearize(const State& x, NormalEquations* out) override;
  double cost(const State& x) override;

 private:
  Unknowns unknowns_;
  int object_;
  Rigidd T_prior_;
  double sigma_m_, sigma_rad_;
};

}  // namespace sdftrack
