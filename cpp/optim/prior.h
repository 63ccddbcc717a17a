// SPDX-License-Identifier: MIT
// A Gaussian prior on one object's pose: constrains the directions that the data leave free.
#pragma once

#include "optim/energy.h"
#include "optim/pose_search.h"

namespace sdftrack::optim {

// E = e^T I e / 2 with the information I; e = (v, w) is the increment from the prior pose to x:
// T_obj_cam = increment(v, w) T_prior, w = 4 MRP.
class PosePrior final : public Energy {
 public:
  using Matrix6d = Eigen::Matrix<double, 6, 6>;

  PosePrior(Unknowns unknowns, int object, const Rigidd& T_obj_cam, const Matrix6d& information)
      : unknowns_(unknowns), object_(object), T_prior_(T_obj_cam), information_(information) {}

  // The information for independent sds; an sd of 0 means no prior on that part.
  static Matrix6d isotropic(double sigma_m, double sigma_rad);

  // The prior in plain numbers.
  PriorTerm term() const;

  Unknowns unknowns() const override { return unknowns_; }
  void linearize(const State& x, NormalEquations* out) override;
  double cost(const State& x) override;

 private:
  Unknowns unknowns_;
  int object_;
  Rigidd T_prior_;
  Matrix6d information_;
};

}  // namespace sdftrack::optim
