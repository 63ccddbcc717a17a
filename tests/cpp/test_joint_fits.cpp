// SPDX-License-Identifier: MIT
// Fits of several objects together on the GPU against optim::minimize; skipped where no GPU answers.
#include <gtest/gtest.h>

#include "base/cuda_probe.h"
#include "box_scene.h"
#include "energies/joint_fits.h"
#include "joint_scene.h"
#ifdef SDFTRACK_CUDA_ON_CPU
#include "control.h"
#endif

namespace sdftrack {
namespace {

constexpr double kSamePose = 1e-5;  // m and rad

void expect_same_pose(const Rigidd& got, const Rigidd& requested, int k) {
  EXPECT_LT(norm(got.t - requested.t), kSamePose) << k;
  EXPECT_LT(rotation_angle(got.R * transpose(requested.R)), kSamePose) << k;
}

void expect_the_minimum_of_the_cpu(int objects, const energies::SdfEnergyOptions& options, bool contact) {
  JointScene scene(objects, options, contact);
  energies::CudaWork device(cuda_devices().front());
  energies::JointFound got;
  energies::fit_together(&device, scene.task(), &got);
  const optim::LmResult requested = scene.minimum();
  ASSERT_GT(requested.steps.size(), 2u);
  for (int k = 0; k < objects; ++k)
    expect_same_pose(got.T_obj_cam[k], requested.x.T_obj_cam[static_cast<std::size_t>(k)], k);
  EXPECT_NEAR(got.cost, requested.cost, 1e-4 * requested.cost);
  EXPECT_EQ(got.count, requested.count);
  EXPECT_NEAR(got.steps[0].cost, requested.steps[0].cost, 1e-4 * requested.steps[0].cost);
}

class JointFits : public testing::TestWithParam<int> {
 protected:
  void SetUp() override {
    if (cuda_devices().empty()) GTEST_SKIP() << (cuda_built() ? "no CUDA device" : "a build without CUDA");
  }
};

TEST_P(JointFits, the_poses_are_the_cpus) { expect_the_minimum_of_the_cpu(GetParam(), {}, false); }
TEST_P(JointFits, contact_counts_as_on_the_cpu) { expect_the_minimum_of_the_cpu(GetParam(), {}, true); }
TEST_P(JointFits, colours_weigh_the_pixels) {
  energies::SdfEnergyOptions options;
  options.color = true;
  expect_the_minimum_of_the_cpu(GetParam(), options, true);
  options.color_likelihood = energies::ColorLikelihood::kPrinted;
  expect_the_minimum_of_the_cpu(GetParam(), options, false);
}
INSTANTIATE_TEST_SUITE_P(Objects, JointFits, testing::Values(2, 3, 4));

#ifdef SDFTRACK_WITH_CUDA
// Boxes side by side, through a whole frame of a tracker.
std::vector<Rigidd> poses_of_frame(int device, int objects) {
  const Camera camera{{300, 300, 199.5, 149.5}, 400, 300, {}};
  tracking::TrackerSettings settings;
  settings.device = device;
  const std::vector<SdfView> volumes(static_cast<std::size_t>(objects), box_volume().view());
  tracking::Tracker tracker(volumes, camera, {}, settings);
  std::vector<BoxImage> images;
  std::vector<Rigidd> first, then;
  for (int k = 0; k < objects; ++k) {
    first.push_back(k ? beside(first.back(), 0.0005) : pose_at({-0.08, 0.06, 0.6}));
    then.push_back(k ? beside(then.back(), 0.0005) : pose_at({-0.077, 0.061, 0.602}));
  }
  std::vector<tracking::PoseHint> hints;
  for (const Rigidd& T : first) hints.push_back(at_pose(T));
  const auto frame_of = [&](const BoxImage& image) {
    return tracker.make_frame({image.depth_m.data(), camera.width, camera.height}, nullptr, 0, nullptr);
  };
  const BoxImage one = image_of(camera, first, 0), two = image_of(camera, then, 1);
  tracker.start(frame_of(one), hints);
  const tracking::FrameResult& result = tracker.track(frame_of(two));
  std::vector<Rigidd> out;
  for (std::size_t k = 0; k < then.size(); ++k) {
    EXPECT_LT(norm(result.objects[k].T_cam_obj.t - then[k].t), 2e-3) << k;
    out.push_back(result.objects[k].T_cam_obj);
  }
  return out;
}

TEST_P(JointFits, a_trackers_frame_is_that_of_the_cpu) {
  const auto cpu = poses_of_frame(-1, GetParam()), gpu = poses_of_frame(cuda_devices().front(), GetParam());
  for (int k = 0; k < GetParam(); ++k)
    expect_same_pose(gpu[static_cast<std::size_t>(k)], cpu[static_cast<std::size_t>(k)], k);
}
#endif

#ifdef SDFTRACK_CUDA_ON_CPU
// And once for each volume that is sent.
TEST_P(JointFits, the_host_waits_once) {
  JointScene scene(GetParam(), {}, true);
  energies::CudaWork device(0);
  energies::JointFound found;
  energies::fit_together(&device, scene.task(), &found);
  const std::int64_t before = cuda_on_cpu::waits();
  energies::fit_together(&device, scene.task(), &found);
  EXPECT_EQ(cuda_on_cpu::waits() - before, 1);
}
#endif

}  // namespace
}  // namespace sdftrack
