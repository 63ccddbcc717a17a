// SPDX-License-Identifier: MIT
// The optimiser on toy problems without images.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "optim/lm.h"
#include "optim/prior.h"

namespace sdftrack {
namespace {

// Point-to-point alignment: E = sum |T_obj_cam a_i - b_i|^2 / 2. Its minimum is known when b = T a.
class Alignment final : public optim::Energy {
 public:
  explicit Alignment(const Rigidd& truth) {
    std::mt19937 random(3);
    std::uniform_real_distribution<double> u(-0.1, 0.1);
    for (int i = 0; i < 30; ++i) {
      a_.push_back({u(random), u(random), u(random)});
      b_.push_back(truth * a_.back());
    }
  }
  optim::Unknowns unknowns() const override { return {1, false, false}; }
  double cost(const optim::State& x) override {
    double sum = 0;
    for (std::size_t i = 0; i < a_.size(); ++i) {
      const Vec3d e = x.T_obj_cam[0] * a_[i] - b_[i];
      sum += 0.5 * dot(e, e);
    }
    return sum;
  }
  void linearize(const optim::State& x, optim::NormalEquations* out) override {
    for (std::size_t i = 0; i < a_.size(); ++i) {
      const Vec3d p = x.T_obj_cam[0] * a_[i], e = p - b_[i];
      Eigen::Matrix<double, 3, 6> J;
      J << 1, 0, 0, 0, p.z, -p.y, 0, 1, 0, -p.z, 0, p.x, 0, 0, 1, p.y, -p.x, 0;
      out->hessian += J.transpose() * J;
      out->gradient += J.transpose() * Eigen::Vector3d(e.x, e.y, e.z);
      out->cost += 0.5 * dot(e, e);
      out->count += 1;
    }
  }

 private:
  std::vector<Vec3d> a_, b_;
};

const Rigidd kTruth{rotation_exp(Vec3d{0.4, -0.3, 0.9}), {0.02, -0.03, 0.05}};

TEST(Lm, finds_the_pose_of_an_alignment_with_known_answer) {
  Alignment energy(kTruth);
  optim::LmOptions options;
  options.max_steps = 50;
  const optim::LmResult r = optim::minimize(energy, {{Rigidd{}}, {}, {}}, options);
  const Rigidd off = r.x.T_obj_cam[0] * inverse(kTruth);
  EXPECT_LT(norm(off.t), 1e-6);
  EXPECT_LT(rotation_angle(off.R), 1e-5);
}

TEST(Lm, a_kept_step_never_raises_the_cost_and_every_trial_is_recorded) {
  Alignment energy(kTruth);
  const optim::LmResult r = optim::minimize(energy, {{Rigidd{}}, {}, {}}, {});
  ASSERT_FALSE(r.steps.empty());
  for (std::size_t i = 1; i < r.steps.size(); ++i) EXPECT_LE(r.steps[i].cost, r.steps[i - 1].cost);
}

TEST(Lm, a_fixed_unknown_keeps_its_value) {
  Alignment energy(kTruth);
  optim::LmOptions options;
  options.fixed = {false, false, true, true, true, true};
  const optim::LmResult r = optim::minimize(energy, {{Rigidd{}}, {}, {}}, options);
  EXPECT_EQ(r.x.T_obj_cam[0].t.z, 0.0);
  EXPECT_LT(orthogonality_error(r.x.T_obj_cam[0].R), 1e-15);
  EXPECT_NE(r.x.T_obj_cam[0].t.x, 0.0);
}

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
