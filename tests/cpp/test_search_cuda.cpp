// SPDX-License-Identifier: MIT
// A search's fits on the GPU against those of the CPU; skipped where no GPU answers.
#include <gtest/gtest.h>

#include "base/cuda_probe.h"
#include "box_scene.h"
#include "frame/points_cuda.h"
#include "point_fixture.h"
#include "tracking/search/search.h"

namespace sdftrack {
namespace {

void skip_without_device() {
  if (cuda_devices().empty()) GTEST_SKIP() << (cuda_built() ? "no CUDA device" : "a build without CUDA");
}

class SearchCuda : public testing::Test {
 protected:
  void SetUp() override { skip_without_device(); }
};

// Counts on both sides of a warp, of the partial sums and of a block of them.
TEST_F(SearchCuda, sums_and_costs_have_the_cpus_bits) {
  energies::CudaWork work(cuda_devices().front());
  frame::PointsOnDevice device(&work);
  const frame::PointOps& cpu = frame::PointOps::baseline;
  for (const int count : {0, 1, 15, 16, 17, 32, 33, 511, 512, 513, 1500}) {
    const PointScene one(count), other(count / 3);
    std::vector<frame::QuickTerms> terms{one.terms(), other.terms()};
    std::vector<frame::PoseOf> poses;
    for (const Rigidf& T : poses_near(9)) poses.push_back({T, static_cast<int>(poses.size() % 2)});
    std::vector<energies::Sums<double, 6>> sums;
    std::vector<frame::QuickCost> costs;
    device.begin();
    device.linearize(terms, poses, &sums);
    device.cost(terms, poses, &costs);
    for (std::size_t k = 0; k < poses.size(); ++k) {
      frame::QuickTerms here = terms[k % 2];
      here.move_to(poses[k].T_obj_cam);
      const energies::Sums<double, 6> requested = cpu.linearize(here);
      for (int i = 0; i < 6; ++i) EXPECT_EQ(sums[k].gradient[i], requested.gradient[i]) << count << ' ' << k;
      for (int i = 0; i < 21; ++i) EXPECT_EQ(sums[k].hessian[i], requested.hessian[i]) << count << ' ' << k;
      const frame::QuickCost cost = cpu.cost(here);
      EXPECT_EQ(costs[k].readings, cost.readings) << count << ' ' << k;
      EXPECT_EQ(costs[k].surface, cost.surface) << count << ' ' << k;
      EXPECT_EQ(costs[k].outline, cost.outline) << count << ' ' << k;
      EXPECT_EQ(costs[k].surface_points, cost.surface_points) << count << ' ' << k;
    }
  }
}

TEST_F(SearchCuda, no_pose_is_no_launch) {
  energies::CudaWork work(cuda_devices().front());
  frame::PointsOnDevice device(&work);
  std::vector<energies::Sums<double, 6>> sums(3);
  std::vector<frame::QuickCost> costs(3);
  device.linearize({}, {}, &sums);
  device.cost({}, {}, &costs);
  EXPECT_TRUE(sums.empty());
  EXPECT_TRUE(costs.empty());
}

// In a mask, in a box and in the whole image: the same poses in the same order.
TEST_F(SearchCuda, a_search_finds_what_it_finds_on_the_cpu) {
  const Camera camera = small_camera();
  const tracking::TrackerOptions options;
  const frame::Shape shape =
      frame::make_shape(box_volume().view(), tracking::kSurfacePoints, tracking::kFreeSpacePoints);
  const BoxImage image = image_of(camera, {pose_at({0.02, -0.01, 0.5})}, 0);
  const frame::DepthFrame frame{{image.depth_m.data(), camera.width, camera.height}, nullptr, nullptr};
  energies::CudaWork work(cuda_devices().front());
  frame::PointsOnDevice device(&work);
  tracking::SearchQuery masked, boxed, anywhere;
  masked.mask = image.mask.data();
  boxed.box = frame::Rect{50, 30, 120, 90};
  boxed.seeds = anywhere.seeds = 30;  // some of the rotations: this one is a test of sums
  for (const tracking::SearchQuery& query : {masked, boxed, anywhere}) {
    tracking::SearchScratch scratch;
    const auto cpu = tracking::search_pose(frame, camera, shape, options, query, 1, &scratch);
    const auto gpu = tracking::search_pose(frame, camera, shape, options, query, 1, &scratch, &device);
    ASSERT_FALSE(cpu.empty());
    ASSERT_EQ(gpu.size(), cpu.size());
    for (std::size_t k = 0; k < cpu.size(); ++k) {
      EXPECT_EQ(gpu[k].score, cpu[k].score) << k;
      EXPECT_EQ(norm(gpu[k].T_cam_obj.t - cpu[k].T_cam_obj.t), 0) << k;
      EXPECT_EQ(norm(gpu[k].T_cam_obj.R.r0 - cpu[k].T_cam_obj.R.r0), 0) << k;
      EXPECT_EQ(norm(gpu[k].T_cam_obj.R.r1 - cpu[k].T_cam_obj.R.r1), 0) << k;
    }
  }
}

}  // namespace
}  // namespace sdftrack
