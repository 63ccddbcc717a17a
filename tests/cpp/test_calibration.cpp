// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <random>

#include "base/normal.h"
#include "calibration/intrinsics.h"
#include "calibration/lens_energy.h"
#include "calibration/noise_fit.h"
#include "volume_fixture.h"

namespace sdftrack {
namespace {

const Volume kBody = make_volume(60, 0.12, [](Vec3d p) {
  return (norm(Vec3d{p.x, 1.5 * p.y, 1.8 * p.z}) - 0.09) * 0.7;
});

calibration::Lens some_lens() {
  calibration::Lens lens{
      {{525, 515, 321, 238}, 640, 480, {0.08, -0.05, 0.002, -0.001, 0.02}}, 1.5, 1.02, 0.004};
  return lens;
}
calibration::FreeLens everything() {
  calibration::FreeLens free;
  for (int j = 0; j < calibration::kLensUnknowns; ++j)
    free.unknowns.push_back(static_cast<calibration::LensUnknown>(j));
  free.distorted = true;
  return free;
}
const Rigidd kPose = inverse(Rigidd{rotation_exp(Vec3d{0.5, -0.4, 0.3}), {0.05, -0.03, 0.6}});

// Readings of the body through the lens, each with an error, and some that are not the body's.
calibration::LensFrame some_frame(const calibration::Lens& lens) {
  calibration::LensFrame frame;
  frame.T_obj_cam = kPose;
  std::mt19937 random(5);
  std::normal_distribution<double> error(0, 0.002);
  for (int v = 140; v < 290; v += 7)
    for (int u = 270; u < 460; u += 7) {
      const Vec3d ray = calibration::look_through(lens, true, u, v).ray;
      double z = 0.5;
      for (int k = 0; k < 50; ++k) {
        double phi;
        Vec3d unused;
        energies::SingleObject<double>{kBody.view(), kPose}.value(z * ray, &phi, &unused);
        z += 0.7 * phi;
      }
      if (z < 0.8) frame.pixels.push(u, v, (z + error(random) - lens.depth_offset_m) / lens.depth_scale);
    }
  for (int i = 0; i < 20; ++i) frame.pixels.push(200 + 10 * i, 130, 0.55);
  return frame;
}

TEST(Lens, a_ray_projects_back_to_its_pixel) {
  const calibration::Lens lens = some_lens();
  const Vec3d ray = calibration::look_through(lens, true, 100, 400).ray;
  const Vec2d xy = distort(lens.camera.distortion, {ray.x, ray.y});
  EXPECT_NEAR(lens.camera.K.fx * xy.x + lens.skew * xy.y + lens.camera.K.cx, 100, 1e-8);
  EXPECT_NEAR(lens.camera.K.fy * xy.y + lens.camera.K.cy, 400, 1e-8);
}

TEST(Lens, derivatives_of_a_ray_are_those_of_finite_differences) {
  const calibration::Lens lens = some_lens();
  const calibration::LensRay at = calibration::look_through(lens, true, 150, 380);
  for (std::size_t j = 0; j < calibration::kLensUnknowns; ++j) {
    const auto which = static_cast<calibration::LensUnknown>(j);
    const double h = j < 5 ? 1e-4 : 1e-7;  // pixels, or plain numbers
    calibration::Lens up = lens, down = lens;
    up.set(which, lens.get(which) + h), down.set(which, lens.get(which) - h);
    const Vec3d a = calibration::look_through(up, true, 150, 380).ray,
                b = calibration::look_through(down, true, 150, 380).ray;
    EXPECT_NEAR(at.dx[j], (a.x - b.x) / (2 * h), 1e-7) << "unknown " << j;
    EXPECT_NEAR(at.dy[j], (a.y - b.y) / (2 * h), 1e-7) << "unknown " << j;
  }
}

double cost_at(calibration::LensFrame frame, const calibration::Lens& lens, const calibration::FreeLens& free,
               const energies::DepthLogistic<double>& penalty, const Rigidd& T) {
  optim::ArrowBlock block;
  frame.T_obj_cam = T;
  frame.linearize({kBody.view(), lens, free}, penalty, false, &block);
  return block.cost;
}

// Which pixels count and which rays meet the model is fixed before.
void expect_the_gradient_of_finite_differences(calibration::OutlineUse outline) {
  const calibration::Lens lens = some_lens();
  const calibration::FreeLens free = everything();
  const energies::DepthLogistic<double> penalty{0.002, 0.1};
  calibration::LensFrame frame = some_frame(lens);
  frame.classify({kBody.view(), lens, free}, outline);
  optim::ArrowBlock block;
  frame.linearize({kBody.view(), lens, free}, penalty, false, &block);
  ASSERT_GT(block.count, 100);
  for (int j = 0; j < 6 + calibration::kLensUnknowns; ++j) {
    const bool pose = j < 6;
    const double h = pose ? 1e-7 : (j < 11 ? 1e-4 : 1e-7);
    double side[2];
    for (int s = 0; s < 2; ++s) {
      const double step = s == 0 ? h : -h;
      calibration::Lens moved = lens;
      Rigidd T = frame.T_obj_cam;
      double d[6] = {};
      if (pose)
        d[j] = step;
      else
        moved.set(static_cast<calibration::LensUnknown>(j - 6),
                  lens.get(static_cast<calibration::LensUnknown>(j - 6)) + step);
      T = increment(Vec3d{d[0], d[1], d[2]}, Vec3d{d[3], d[4], d[5]}) * T;
      side[s] = cost_at(frame, moved, free, penalty, T);
    }
    const double numeric = (side[0] - side[1]) / (2 * h);
    const double analytic = pose ? block.pose_gradient[j] : block.shared_gradient[j - 6];
    const double curvature = pose ? block.pose(j, j) : block.shared(j - 6, j - 6);
    // Per standard deviation of the unknown; the field has kinks between its cells.
    EXPECT_NEAR(analytic / std::sqrt(curvature), numeric / std::sqrt(curvature), 2e-3) << "unknown " << j;
  }
}

TEST(LensFrame, its_gradient_is_that_of_finite_differences) {
  using enum calibration::OutlineUse;
  for (const calibration::OutlineUse outline : {kAll, kWithin, kPoints})
    expect_the_gradient_of_finite_differences(outline);
}

// Blocks of made-up numbers whose sum is positive definite.
std::vector<optim::ArrowBlock> some_blocks(int shared) {
  std::mt19937 random(3);
  std::normal_distribution<double> normal;
  std::vector<optim::ArrowBlock> blocks(4);
  for (optim::ArrowBlock& block : blocks) {
    const int n = 6 + shared;
    const Eigen::MatrixXd J = Eigen::MatrixXd::NullaryExpr(2 * n, n, [&] { return normal(random); });
    const Eigen::MatrixXd H = J.transpose() * J;
    block.reset(shared);
    block.pose = H.topLeftCorner<6, 6>(), block.cross = H.topRightCorner(6, shared);
    block.shared = H.bottomRightCorner(shared, shared);
    for (int j = 0; j < 6; ++j) block.pose_gradient[j] = normal(random);
    for (int j = 0; j < shared; ++j) block.shared_gradient[j] = normal(random);
  }
  return blocks;
}

// A quadratic whose minimum one undamped step reaches: what the step is can be read off the state.
class Quadratic final : public optim::ArrowEnergy {
 public:
  explicit Quadratic(std::vector<optim::ArrowBlock> blocks) : blocks_(std::move(blocks)) {
    state_.setZero(24 + shared_unknowns());
  }
  int shared_unknowns() const override { return static_cast<int>(blocks_[0].shared.rows()); }
  void linearize(bool trial, std::vector<optim::ArrowBlock>* blocks, optim::ArrowBlock*) override {
    *blocks = blocks_;
    const Eigen::VectorXd& at = trial ? trial_ : state_;
    for (std::size_t m = 0; m < blocks->size(); ++m) {
      optim::ArrowBlock& b = (*blocks)[m];
      const optim::Vector6d pose = at.segment<6>(6 * static_cast<Eigen::Index>(m));
      const optim::SharedVector shared = at.tail(shared_unknowns());
      b.cost = b.pose_gradient.dot(pose) + b.shared_gradient.dot(shared) + 0.5 * pose.dot(b.pose * pose) +
               pose.dot(b.cross * shared) + 0.5 * shared.dot(b.shared * shared);
      b.pose_gradient += b.pose * pose + b.cross * shared;
      b.shared_gradient += b.cross.transpose() * pose + b.shared * shared;
      b.count = 1;
    }
  }
  void retract(const std::vector<optim::Vector6d>& poses, const optim::SharedVector& shared) override {
    trial_ = state_;
    for (std::size_t m = 0; m < poses.size(); ++m)
      trial_.segment<6>(6 * static_cast<Eigen::Index>(m)) += poses[m];
    trial_.tail(shared_unknowns()) += shared;
  }
  void accept() override { state_ = trial_; }
  bool is_small(const std::vector<optim::Vector6d>&, const optim::SharedVector&) const override {
    return false;
  }

  Eigen::VectorXd state_, trial_;

 private:
  std::vector<optim::ArrowBlock> blocks_;
};

TEST(Arrow, its_step_is_that_of_the_dense_equations) {
  constexpr int kShared = 4;
  const std::vector<optim::ArrowBlock> blocks = some_blocks(kShared);
  Eigen::MatrixXd H = Eigen::MatrixXd::Zero(24 + kShared, 24 + kShared);
  Eigen::VectorXd g = Eigen::VectorXd::Zero(24 + kShared);
  for (int m = 0; m < 4; ++m) {
    const optim::ArrowBlock& b = blocks[static_cast<std::size_t>(m)];
    H.block<6, 6>(6 * m, 6 * m) = b.pose;
    H.block(6 * m, 24, 6, kShared) = b.cross, H.block(24, 6 * m, kShared, 6) = b.cross.transpose();
    H.bottomRightCorner(kShared, kShared) += b.shared;
    g.segment<6>(6 * m) = b.pose_gradient, g.tail(kShared) += b.shared_gradient;
  }
  Quadratic energy(blocks);
  optim::LmOptions options;
  options.damping = options.damping_min = 1e-12, options.max_steps = 2;
  optim::LmRecord record;
  optim::minimize(energy, options, &record);
  const Eigen::VectorXd dense = -H.ldlt().solve(g);
  EXPECT_LT((energy.state_ - dense).norm(), 1e-8 * dense.norm());
}

// The body as a lens of 160 x 120 pixels sees it from three sides, with noise.
calibration::IntrinsicsProblem solved_problem(const frame::Shape& shape, const calibration::Lens& lens) {
  calibration::IntrinsicsProblem problem(shape, lens,
                                         {calibration::LensUnknown::kFx, calibration::LensUnknown::kFy}, {});
  std::mt19937 random(1);
  std::normal_distribution<double> noise(0, 0.004);
  for (const double turn : {0.4, 1.1, 2.0}) {
    const Rigidd T_cam_obj{rotation_exp(Vec3d{0.5, turn, 0.3}), {0.03 * turn - 0.03, 0.01, 0.4}};
    std::vector<float> depth_m;
    for (int i = 0; i < 160 * 120; ++i) {
      const Vec3d ray = calibration::look_through(lens, false, i % 160, i / 160).ray;
      double z = 0.25, phi;
      Vec3d unused;
      for (int k = 0; k < 60 && z < 0.6; ++k) {
        energies::SingleObject<double>{kBody.view(), inverse(T_cam_obj)}.value(z * ray, &phi, &unused);
        z += 0.7 * phi;
      }
      depth_m.push_back(z < 0.6 ? static_cast<float>(z + noise(random)) : 0.0f);
    }
    problem.add({{depth_m.data(), 160, 120}, nullptr, nullptr}, T_cam_obj);
  }
  problem.solve(0.004, nullptr, false);
  return problem;
}

TEST(Intrinsics, the_bias_is_the_mean_error_of_estimates_from_mirrored_noise) {
  const frame::Shape shape = frame::make_shape(kBody.view(), 100, 10);
  calibration::IntrinsicsProblem problem =
      solved_problem(shape, {{{131, 131, 79.5, 59.5}, 160, 120, {}}, 0, 1, 0});
  const calibration::Lens truth = problem.lens();
  const std::vector<calibration::FrameEstimate> each = problem.examine();
  constexpr std::uint64_t kSeed = 7;
  const optim::SharedVector bias = problem.bias(kSeed, 2);
  optim::SharedVector sum = optim::SharedVector::Zero(2);
  for (int draw = 0; draw < 4; ++draw) {
    std::mt19937_64 random(kSeed + static_cast<std::uint64_t>(draw / 2));
    Normal normal;
    std::vector<calibration::LensFrame> twins(3);
    std::vector<calibration::LensFrame*> frames;
    for (int m = 0; m < 3; ++m) {
      calibration::LensFrame& twin = twins[static_cast<std::size_t>(m)];
      const Rigidd T = problem.T_cam_obj(m);
      twin.T_obj_cam = inverse(Rigidd{T.R, T * shape.centre_obj});
      twin.pixels = problem.pixels(m), twin.noise_m = each[static_cast<std::size_t>(m)].noise_m;
      for (std::size_t i = 0; i < twin.pixels.reading_m.size(); ++i) {
        const double error = (draw % 2 ? -1 : 1) * twin.noise_m * normal(random);
        if (twin.pixels.used[i]) twin.pixels.reading_m[i] = twin.pixels.hit_m[i] + error;
      }
      frames.push_back(&twin);
    }
    calibration::Lens lens = truth;
    const calibration::IntrinsicsOptions options;
    calibration::LensSolver(shape.sdf, problem.free(), options, frames, &lens, nullptr)
        .fine(options.stride(options.twin_pixels));
    sum[0] += lens.camera.K.fx - truth.camera.K.fx, sum[1] += lens.camera.K.fy - truth.camera.K.fy;
  }
  EXPECT_GT(bias.norm(), 1e-3);
  EXPECT_LT((bias - sum / 4).norm(), 1e-6 * bias.norm());
}

TEST(NoiseFit, exact_samples_give_back_the_model) {
  std::vector<calibration::NoiseSample> samples;
  for (const double z : {0.5, 0.8, 1.3})
    for (const double t : {0.0, 0.5, 1.2})
      samples.push_back({z, t, std::hypot(0.001 + 0.002 * z * z, 0.003 * z * t), 1000});
  const calibration::NoiseModel found = calibration::fit_noise(samples);
  EXPECT_NEAR(found.noise_m, 0.001, 1e-8);
  EXPECT_NEAR(found.noise_per_m, 0.002, 1e-8);
  EXPECT_NEAR(found.noise_incidence, 0.003, 1e-8);
}

TEST(NoiseFit, growth_passes_over_outliers_and_needs_a_span) {
  std::vector<double> z, value;
  for (int i = 0; i < 12; ++i)
    z.push_back(0.5 + 0.1 * i), value.push_back(0.004 - 0.001 * z.back() * z.back());
  value[3] += 0.5;
  const calibration::Growth found = calibration::fit_growth(z, value, true);
  EXPECT_NEAR(found.constant, 0.004, 1e-5);
  EXPECT_NEAR(found.per_m2, -0.001, 1e-5);
  EXPECT_EQ(calibration::fit_growth(z, value, false).per_m2, 0);
  EXPECT_EQ(calibration::fit_growth({1, 1.1, 1.2}, {3, 1, 2}, true).constant, 2);
}

}  // namespace
}  // namespace sdftrack
