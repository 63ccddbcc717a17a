// SPDX-License-Identifier: MIT
// A reconstruction on a GPU against that of the CPU, frame by frame.
#include <gtest/gtest.h>

#include "ball_frames.h"
#include "base/cuda_probe.h"

namespace sdftrack {
namespace {

using reconstruction::Reconstruction;

constexpr double kVoxel_m = 0.004;
#ifdef SDFTRACK_CUDA_ON_CPU
constexpr float kRatioTolerance = 0, kVoxelTolerance = 1e-4f;  // the same functions in the same order
#else
// exp, log and erf are the device's own: 2e-5 in a frame. A surface that moves by the least that distances
// follow, 0.02 voxels, may then be followed a frame earlier or later.
constexpr float kRatioTolerance = 3e-4f, kVoxelTolerance = 0.02f;
#endif
constexpr float kVoxel = static_cast<float>(kVoxel_m);
constexpr float kTolerance_m = kVoxelTolerance * kVoxel;
// Beyond the band the CPU's two rounds of sweeps end this far before what rounds without end give.
constexpr float kFarTolerance_m = 10 * kTolerance_m, kBand_m = 8 * kVoxel;

template <class A, class B>
float farthest(const A& a, const B& b) {
  float most = 0;
  for (std::size_t i = 0; i < a.size(); ++i)
    most = std::max(most, std::abs(static_cast<float>(a[i]) - static_cast<float>(b[i])));
  return most;
}

void expect_same(const Reconstruction& cpu, const Reconstruction& gpu) {
  EXPECT_LE(farthest(gpu.evidence().log_ratio(), cpu.evidence().log_ratio()), kRatioTolerance);
  EXPECT_LE(farthest(gpu.evidence().weight(), cpu.evidence().weight()), kRatioTolerance);
  int colors = 0;
  for (std::size_t i = 0; i < cpu.colors().size(); ++i) {
    const auto &a = cpu.colors()[i], &b = gpu.colors()[i];
    colors += std::abs(a.r - b.r) > 2 || std::abs(a.b - b.b) > 2 || std::abs(a.seen - b.seen) > 2;
  }
  EXPECT_EQ(colors, 0);
  float near = 0;
  for (std::size_t i = 0; i < cpu.phi().size(); ++i)
    if (std::abs(cpu.phi()[i]) < kBand_m) near = std::max(near, std::abs(gpu.phi()[i] - cpu.phi()[i]));
  EXPECT_LE(near, kTolerance_m);
  EXPECT_LE(farthest(gpu.phi(), cpu.phi()), kFarTolerance_m);
  EXPECT_NEAR(gpu.change_m(), cpu.change_m(), kTolerance_m);
  const auto a = cpu.surface_boxes(), b = gpu.surface_boxes();
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t k = 0; k < a.size(); ++k)
    EXPECT_TRUE(a[k].x0 == b[k].x0 && a[k].y0 == b[k].y0 && a[k].z0 == b[k].z0);
}

class DeviceVolume : public testing::Test {
 protected:
  void SetUp() override {
    if (cuda_devices().empty()) GTEST_SKIP() << (cuda_built() ? "no CUDA device" : "a build without CUDA");
  }
};

TEST_F(DeviceVolume, follows_frames_as_the_cpu_does) {
  const BallFrames frames;
  for (const int n : {40, 43}) {  // whole blocks, and parts of blocks
    Reconstruction cpu = frames.begun(n, kVoxel_m), gpu = frames.begun(n, kVoxel_m, cuda_devices()[0]);
    for (int k = 0; k < 14; ++k) {
      frames.fuse(k, &cpu), frames.fuse(k, &gpu);
      if (k % 3 == 1) continue;  // what two frames have changed is shown at once
      gpu.show(1);
      expect_same(cpu, gpu);
      if (HasFailure()) FAIL() << "frame " << k << ", " << n << " voxels";
    }
  }
}

TEST_F(DeviceVolume, grows_and_goes_on_as_the_cpu_does) {
  const BallFrames frames;
  Reconstruction cpu = frames.begun(40, kVoxel_m), gpu = frames.begun(40, kVoxel_m, cuda_devices()[0]);
  for (int k = 0; k < 2; ++k) frames.fuse(k, &cpu), frames.fuse(k, &gpu);
  const auto larger_cpu = cpu.grown({1, 0, 0}, {0, 0, 2}, 1), larger_gpu = gpu.grown({1, 0, 0}, {0, 0, 2}, 1);
  expect_same(*larger_cpu, *larger_gpu);
  const auto next_cpu = larger_cpu->continued(nullptr, 1), next_gpu = larger_gpu->continued(nullptr, 1);
  frames.fuse(2, next_cpu.get()), frames.fuse(2, next_gpu.get());
  next_gpu->show(1);
  expect_same(*next_cpu, *next_gpu);
}

}  // namespace
}  // namespace sdftrack
