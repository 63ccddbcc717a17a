// SPDX-License-Identifier: MIT
// What objects in one place cost, against finite differences and cases with a known answer.
#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>

#include "box_scene.h"
#include "optim/lm.h"
#include "optim/prior.h"
#include "tracking/several/collision.h"
#include "tracking/several/joint_fit.h"

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

// Thesis Eqs. 5.14, 5.24 and 5.25, of every stride-th point of every object, wherever it is.
double printed_cost(const std::vector<const frame::Shape*>& shapes, const optim::State& x, double scale_m,
                    double sharpness, std::size_t stride) {
  double voxel_m = 1, cost = 0;
  for (const frame::Shape* shape : shapes)
    voxel_m = std::min(voxel_m, static_cast<double>(shape->sdf.voxel_m));
  const double a = sharpness / voxel_m;
  for (std::size_t m = 1; m < shapes.size(); ++m) {
    double sum = 0, count = 0;
    for (std::size_t k = 0; k < shapes[m]->contact.size(); k += stride, ++count) {
      const Vec3d C_cam = inverse(x.T_obj_cam[m]) * shapes[m]->contact[k].cast<double>();
      std::vector<double> phi_m(m);
      Vec3d unused;
      for (std::size_t j = 0; j < m; ++j) sample(shapes[j]->sdf, x.T_obj_cam[j] * C_cam, &phi_m[j], &unused);
      const double least_m = *std::min_element(phi_m.begin(), phi_m.end());  // exp() would underflow without
      double exponentials = 0;
      for (const double phi : phi_m) exponentials += std::exp(-a * (phi - least_m));
      const double union_m = least_m - std::log(exponentials) / a;
      sum += union_m > 0 ? 1 - std::pow(std::cosh(union_m / (2 * scale_m)), -2) : 0;
    }
    cost -= std::log(sum / count);
  }
  return cost;
}

// A part in 1e6 is what is left out beyond 16 s.
constexpr double kPrintedRtol = 1e-6;

TEST(Collision, the_printed_form_is_that_of_a_loop_over_all_points) {
  const std::vector<const frame::Shape*> shapes{&kBall, &kBox, &kBall};
  const Rigidd turned{rotation_exp(Vec3d{0.2, -0.1, 0.3}), {0, 0, 0.5}};
  for (const double gap_m : {-0.02, -0.001, 0.0, 0.0005, 0.005, 0.02})
    for (const double scale_m : {0.001, 0.002, 0.005})
      for (const double sharpness : {1.0, 2.0, 40.0}) {
        // Two balls in the corner of a box: a point of the third object is next to both of the others.
        const optim::State x = at({{turned.R, turned.t},
                                   {turned.R, turned * Vec3d{0, 0.05 + gap_m, 0}},
                                   {turned.R, turned * Vec3d{0.045 + gap_m, 0.04 + gap_m, 0.01}}});
        tracking::CollisionEnergy energy({tracking::Collision::kPrinted, 1, scale_m, sharpness});
        energy.prepare(shapes, {500, 500, 500}, x, 0.003, 2);
        const double expected = printed_cost(shapes, x, scale_m, sharpness, 2);
        EXPECT_NEAR(energy.cost(x), expected, kPrintedRtol * (expected + 1e-3))
            << gap_m << " m, s " << scale_m << ", sharpness " << sharpness;
      }
}

// The poses are held where they are, so that nothing but the constraint distinguishes two fits.
TEST(Collision, the_printed_form_has_the_scale_and_the_sharpness_of_the_stage) {
  PartsFixture parts;
  const Rigidd first = pose_at({-0.02, 0.01, 0.55});
  const std::vector<Rigidd> boxes{first, beside(first, 0.0005)};
  for (const Rigidd& T_cam_obj : boxes) parts.add(T_cam_obj);
  parts.open(boxes, 0);
  const optim::PosePrior::Matrix6d held = optim::PosePrior::isotropic(1e-9, 1e-9);
  std::vector<tracking::FitTarget> targets;
  for (const tracking::TrackedObject& object : parts.objects)
    targets.push_back({*object.shape, object.T_cam_obj, held, {}});
  for (const double noise_m : {0.001, 0.003})
    for (const double sharpness : {2.0, 40.0}) {
      tracking::TrackerOptions options;
      options.adapt_noise = false, options.noise_m = noise_m, options.union_sharpness = sharpness;
      options.scale_start_m = 0, options.stop_printed = true;
      double cost[2];
      for (const bool printed : {false, true}) {
        tracking::JointFitter fitter(options,
                                     printed ? tracking::Collision::kPrinted : tracking::Collision::kNone, 1);
        const auto& fitted = fitter.fit(parts.context.frame(), parts.camera, targets, nullptr);
        cost[printed] = fitted[0].fitted.steps.back().step.cost;
        EXPECT_EQ(fitted[0].fitted.steps.back().scale_m, static_cast<double>(static_cast<float>(noise_m)));
      }
      optim::State x = at({targets[0].expected, targets[1].expected});
      const double expected = printed_cost({&targets[0].shape, &targets[1].shape}, x, noise_m, sharpness, 1);
      EXPECT_GT(expected, 0.05);
      EXPECT_NEAR(cost[1] - cost[0], expected, kPrintedRtol * expected + 1e-12 * cost[0]) << noise_m;
    }
}

optim::State two_balls(double gap_m) {
  return at({{rotation_exp(Vec3d{0, 0, 0}), {0, 0, 0.5}},
             {rotation_exp(Vec3d{0.2, 0.1, 0}), {2 * kRadius_m + gap_m, 0, 0.5}}});
}

// Of two balls that are held where they penetrate each other by 30 mm, as firmly as by 750 measurements with
// 1 mm of noise each, what is left of it (m).
double left_of_30_mm(tracking::Collision kind) {
  const optim::State x = two_balls(-0.03);
  tracking::CollisionEnergy energy({kind});
  energy.prepare({&kBall, &kBall}, {750, 750}, x, 0.04);
  const double sd_m = 0.001 / std::sqrt(750.0);
  optim::PosePrior first({1, false, false}, 0, x.T_obj_cam[0], optim::PosePrior::isotropic(sd_m, 1));
  optim::PosePrior second({1, false, false}, 0, x.T_obj_cam[1], optim::PosePrior::isotropic(sd_m, 1));
  optim::GroupEnergy group;
  group.clear(2);
  const int zero = 0, one = 1;
  group.add(&first, 1, &zero, 1), group.add(&second, 1, &one, 1), group.add(&energy);
  optim::LmOptions lm;
  lm.max_steps = 100;
  const optim::State found = optim::minimize(group, x, lm).x;
  return 2 * kRadius_m - norm(inverse(found.T_obj_cam[0]).t - inverse(found.T_obj_cam[1]).t);
}

// Points inside have no slope, but those around them do.
TEST(Collision, the_printed_form_separates_objects_but_hardly_against_data) {
  double before = 0;
  for (const double gap_m : {-0.001, -0.005, -0.01, -0.02}) {
    const optim::State x = two_balls(gap_m);
    tracking::CollisionEnergy energy({tracking::Collision::kPrinted});
    energy.prepare({&kBall, &kBall}, {750, 750}, x, 0.003);
    optim::NormalEquations eq;
    eq.reset(12);
    energy.linearize(x, &eq);
    EXPECT_GT(eq.cost, before) << gap_m;
    const Vec3d slope = inverse(x.T_obj_cam[1]).R * Vec3d{eq.gradient[6], eq.gradient[7], eq.gradient[8]};
    // Per metre; an increment of T_obj_cam moves the object the other way. One measurement that is 1 mm off,
    // with noise of 1 mm, has 460.
    EXPECT_GT(slope.x, 5) << gap_m;
    EXPECT_LT(slope.x, 20) << gap_m;
    before = eq.cost;
  }
  EXPECT_LT(left_of_30_mm(tracking::Collision::kContact), 0.0015);
  EXPECT_GT(left_of_30_mm(tracking::Collision::kPrinted), 0.0299);
}

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
