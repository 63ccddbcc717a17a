// SPDX-License-Identifier: MIT
// How the optimiser ends, sums of energies, and priors.
#include <gtest/gtest.h>

#include <cmath>

#include "optim/lm.h"
#include "optim/prior.h"

namespace sdftrack {
namespace {

TEST(Lm, an_energy_without_data_stops_and_says_so) {
  class Nothing final : public optim::Energy {
    optim::Unknowns unknowns() const override { return {1, false, false}; }
    void linearize(const optim::State&, optim::NormalEquations*) override {}
    double cost(const optim::State&) override { return 0; }
  } nothing;
  EXPECT_EQ(optim::minimize(nothing, {{Rigidd{}}, {}, {}}, {}).stop, optim::Stop::kNoData);
}

TEST(Lm, an_energy_that_is_not_finite_stops_and_says_so) {
  class Broken final : public optim::Energy {
    optim::Unknowns unknowns() const override { return {1, false, false}; }
    void linearize(const optim::State&, optim::NormalEquations* out) override {
      out->hessian.setIdentity();
      out->gradient.setConstant(std::nan(""));
    }
    double cost(const optim::State&) override { return 0; }
  } broken;
  EXPECT_EQ(optim::minimize(broken, {{Rigidd{}}, {}, {}}, {}).stop, optim::Stop::kNotFinite);
}

TEST(Lm, a_sum_of_energies_balances_their_minima) {
  // Equal and opposite pulls on t.x: the minimum lies where the weights say.
  optim::PosePrior left({1, false, false}, 0, {Mat3d::identity(), {-0.01, 0, 0}},
                        optim::PosePrior::isotropic(1, 1));
  optim::PosePrior right({1, false, false}, 0, {Mat3d::identity(), {0.01, 0, 0}},
                         optim::PosePrior::isotropic(1, 1));
  optim::SumEnergy sum;
  sum.add(&left, 1);
  sum.add(&right, 3);
  optim::LmOptions options;
  options.step_m = options.step_rad = 1e-9;
  options.cost_relative = 0;
  EXPECT_NEAR(optim::minimize(sum, {{Rigidd{}}, {}, {}}, options).x.T_obj_cam[0].t.x, 0.005, 1e-8);
}

TEST(Prior, the_gradient_is_the_slope_of_the_cost_far_from_the_prior_too) {
  optim::PosePrior::Matrix6d correlated = optim::PosePrior::isotropic(0.03, 0.3);
  correlated(0, 4) = correlated(4, 0) = 40, correlated(1, 2) = correlated(2, 1) = -500;
  optim::PosePrior prior({1, false, false}, 0, {rotation_exp(Vec3d{0.2, 0.1, -0.3}), {0.1, 0.2, 0.3}},
                         correlated);
  const optim::State x{{{rotation_exp(Vec3d{-0.7, 0.4, 0.5}), {0.15, 0.1, 0.35}}}, {}, {}};
  optim::NormalEquations eq;
  eq.reset(6);
  prior.linearize(x, &eq);
  EXPECT_NEAR(eq.cost, prior.cost(x), 1e-12);
  for (int j = 0; j < 6; ++j) {
    Eigen::VectorXd d = Eigen::VectorXd::Zero(6);
    const double h = 1e-6;
    d[j] = h;
    const double up = prior.cost(optim::retract(prior.unknowns(), x, d)),
                 down = prior.cost(optim::retract(prior.unknowns(), x, -d));
    EXPECT_NEAR((up - down) / (2 * h), eq.gradient[j], 1e-6 * eq.gradient.cwiseAbs().maxCoeff());
  }
}

}  // namespace
}  // namespace sdftrack
