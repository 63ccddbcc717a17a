// SPDX-License-Identifier: MIT
// What objects in one place cost, against finite differences and cases with a known answer.
#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>

#include "optim/lm.h"
#include "optim/prior.h"
#include "tracking/several/collision.h"
#include "volume_fixture.h"

namespace sdftrack {
namespace {

constexpr double kRadius_m = 0.03;
const Volume kBallVolume = make_volume(60, 0.05, [](Vec3d p) { return norm(p) - kRadius_m; });
const Volume kBoxVolume = make_volume(60, 0.05, [](Vec3d p) { return box_distance(p, {0.03, 0.02, 0.025}); });
const frame::Shape kBall = frame::make_shape(kBallVolume.view(), 960, 100);
const frame::Shape kBox = frame::make_shape(kBoxVolume.view(), 960, 100);

optim::State at(const std::vector<Rigidd>& T_cam_obj) {
  optim::State x;
  for (const Rigidd& T : T_cam_obj) x.T_obj_cam.push_back(inverse(T));
  return x;
}

optim::State three_in_one_another() {
  return at({{rotation_exp(Vec3d{0.3, 0.1, -0.4}), {0.0, 0.0, 0.5}},
             {rotation_exp(Vec3d{-0.2, 0.5, 0.1}), {0.035, 0.005, 0.51}},
             {rotation_exp(Vec3d{0.1, -0.3, 0.7}), {0.01, 0.04, 0.49}}});
}

Eigen::VectorXd unit(int n, int i, double h) {
  Eigen::VectorXd d = Eigen::VectorXd::Zero(n);
  d[i] = h;
  return d;
}

class CollisionKind : public testing::TestWithParam<tracking::Collision> {};

TEST_P(CollisionKind, the_gradient_is_the_slope_of_the_cost) {
  tracking::CollisionEnergy energy({GetParam()});
  const optim::State x = three_in_one_another();
  energy.prepare({&kBox, &kBall, &kBox}, {500, 300, 700}, x, 0.02);
  optim::NormalEquations eq;
  eq.reset(18);
  energy.linearize(x, &eq);
  EXPECT_EQ(eq.cost, energy.cost(x));
  ASSERT_GT(eq.cost, 0);
  const double h = 1e-8;
  for (int i = 0; i < 18; ++i) {
    const optim::Unknowns unknowns = energy.unknowns();
    const double slope = (energy.cost(optim::retract(unknowns, x, unit(18, i, h))) -
                          energy.cost(optim::retract(unknowns, x, unit(18, i, -h)))) /
                         (2 * h);
    EXPECT_NEAR(slope, eq.gradient[i], 1e-5 * eq.gradient.cwiseAbs().maxCoeff()) << i;
  }
  EXPECT_LT((eq.hessian - eq.hessian.transpose()).cwiseAbs().maxCoeff(), 1e-9 * eq.hessian.norm());
  EXPECT_GT(eq.hessian.selfadjointView<Eigen::Lower>().eigenvalues().minCoeff(), -1e-9 * eq.hessian.norm());
}
INSTANTIATE_TEST_SUITE_P(Both, CollisionKind,
                         testing::Values(tracking::Collision::kContact, tracking::Collision::kPrinted));

TEST(Collision, objects_apart_cost_nothing_and_push_nobody) {
  tracking::CollisionEnergy energy({tracking::Collision::kContact});
  const optim::State x =
      at({{rotation_exp(Vec3d{0, 0, 0}), {0, 0, 0.5}}, {rotation_exp(Vec3d{0, 0, 0}), {0.07, 0, 0.5}}});
  energy.prepare({&kBall, &kBall}, {500, 500}, x, 0.02);
  EXPECT_FALSE(energy.empty());
  optim::NormalEquations eq;
  eq.reset(12);
  energy.linearize(x, &eq);
  EXPECT_EQ(eq.cost, 0);
  EXPECT_EQ(eq.gradient.cwiseAbs().maxCoeff(), 0);
}

TEST(Collision, the_order_of_the_objects_does_not_matter_to_contact) {
  const optim::State x = three_in_one_another();
  optim::State reversed = x;
  std::swap(reversed.T_obj_cam[0], reversed.T_obj_cam[2]);
  tracking::CollisionEnergy energy({tracking::Collision::kContact}), other({tracking::Collision::kContact});
  energy.prepare({&kBox, &kBall, &kBall}, {500, 300, 700}, x, 0.02);
  other.prepare({&kBall, &kBall, &kBox}, {700, 300, 500}, reversed, 0.02);
  EXPECT_NEAR(energy.cost(x), other.cost(reversed), 1e-12 * energy.cost(x));
}

// A term of some objects enters the whole where they stand.
TEST(GroupEnergy, is_the_sum_of_its_terms_over_their_own_objects) {
  const optim::State x = three_in_one_another();
  optim::PosePrior last({1, false, false}, 0, x.T_obj_cam[0], optim::PosePrior::isotropic(0.01, 0.1));
  tracking::CollisionEnergy pair({tracking::Collision::kContact});
  optim::State two{{x.T_obj_cam[2], x.T_obj_cam[0]}, x.K, {}};
  pair.prepare({&kBox, &kBox}, {100, 100}, two, 0.02);
  optim::GroupEnergy group;
  group.clear(3);
  const int of_last = 2, of_pair[2] = {2, 0};
  group.add(&last, 0.5, &of_last, 1);
  group.add(&pair, 1, of_pair, 2);
  optim::NormalEquations eq;
  eq.reset(18);
  group.linearize(x, &eq);
  EXPECT_NEAR(eq.cost, group.cost(x), 1e-12 * eq.cost);
  const double h = 1e-8;
  for (int i = 0; i < 18; ++i) {
    const double slope = (group.cost(optim::retract(group.unknowns(), x, unit(18, i, h))) -
                          group.cost(optim::retract(group.unknowns(), x, unit(18, i, -h)))) /
                         (2 * h);
    EXPECT_NEAR(slope, eq.gradient[i], 1e-5 * eq.gradient.cwiseAbs().maxCoeff()) << i;
  }
  EXPECT_EQ(eq.gradient.segment(6, 6).cwiseAbs().maxCoeff(), 0);
  EXPECT_EQ(eq.hessian.block(6, 0, 6, 18).cwiseAbs().maxCoeff(), 0);
  EXPECT_GT(eq.hessian.block(12, 0, 6, 6).cwiseAbs().maxCoeff(), 0);
}

// 20 objects are solved by a sparse factorisation: each goes where its own prior says.
TEST(GroupEnergy, many_objects_find_their_own_minima) {
  optim::State x, requested;
  std::vector<optim::PosePrior> priors;
  for (int k = 0; k < 20; ++k) {
    x.T_obj_cam.push_back(inverse(Rigidd{rotation_exp(Vec3d{0, 0, 0}), {0.1 * k, 0, 0.5}}));
    requested.T_obj_cam.push_back(
        inverse(Rigidd{rotation_exp(Vec3d{0.1, 0, 0.02 * k}), {0.1 * k + 0.01, 0.02, 0.5}}));
    priors.emplace_back(optim::Unknowns{1, false, false}, 0, requested.T_obj_cam.back(),
                        optim::PosePrior::isotropic(0.01, 0.1));
  }
  optim::GroupEnergy group;
  group.clear(20);
  for (int k = 0; k < 20; ++k) group.add(&priors[static_cast<std::size_t>(k)], 1, &k, 1);
  optim::LmOptions lm;
  lm.max_steps = 50;
  const optim::State found = optim::minimize(group, x, lm).x;
  for (std::size_t k = 0; k < 20; ++k)
    EXPECT_LT(norm(found.T_obj_cam[k].t - requested.T_obj_cam[k].t), 1e-6) << k;
}

}  // namespace
}  // namespace sdftrack
