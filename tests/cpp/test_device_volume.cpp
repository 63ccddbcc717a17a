// SPDX-License-Identifier: MIT
// A reconstruction on a GPU against that of the CPU, frame by frame.
#include <gtest/gtest.h>

#include <algorithm>
#include <limits>

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
      expect_same(cpu, gpu);
      if (HasFailure()) FAIL() << "frame " << k << ", " << n << " voxels";
    }
  }
}

// Whose the readings are, and the image that they make: by colour, above a plane, through a lens, of a part
// of the image, with wide borders and none, as the thesis has it.
TEST_F(DeviceVolume, reads_frames_as_the_cpu_does) {
  const auto compare = [](const BallFrames& frames, const reconstruction::ReconstructionOptions& options,
                          const char* what) {
    SCOPED_TRACE(what);
    Reconstruction cpu = frames.begun(24, 0.007, -1, options),
                   gpu = frames.begun(24, 0.007, cuda_devices()[0], options);
    for (int k = 0; k < 4; ++k) frames.fuse(k, &cpu), frames.fuse(k, &gpu);
    expect_same(cpu, gpu);
  };
  BallFrames frames;
  frames.by_color = true;
  compare(frames, {}, "by colour");
  std::vector<float> from_m(80 * 60);
  for (std::size_t i = 0; i < from_m.size(); i += 3) from_m[i] = 0.39f;
  frames.view = std::make_shared<reconstruction::FirstView>(
      frames.camera, Rigidd{rotation_exp(Vec3d{0.3, 0.0, 0.1}), {0, 0, BallFrames::kAway_m}}, from_m,
      std::vector<reconstruction::PlaneBelow>{{{0, -1, 0}, 0.03, 0.002}, {{0, 0, -1}, 0.5, 0.002}},
      reconstruction::Place{{0, 0, BallFrames::kAway_m}, 0.03});
  compare(frames, {}, "above planes");
  frames.rect = {7, 5, 76, 52};
  compare(frames, {}, "a part of the image");
  frames.camera.distortion = {0.1, -0.05, 0.002, -0.001, 0.01};
  compare(frames, {}, "through a lens");
  for (const int border_px : {0, 1, 5}) {
    reconstruction::ReconstructionOptions options;
    options.image.border_px = border_px;
    compare(frames, options, "border");
  }
  reconstruction::ReconstructionOptions printed;
  printed.evidence.form.printed = true;
  compare(frames, printed, "printed");
}

// Readings of one surface that winds through the image and begins on the object: an object's to its end.
TEST_F(DeviceVolume, follows_a_winding_surface_to_its_end) {
  constexpr int kWidth = 601, kHeight = 41;  // rows longer than a block of threads
  const Camera camera{{400, 400, 300, 20}, kWidth, kHeight, {}};
  std::vector<float> depth(static_cast<std::size_t>(kWidth) * kHeight);
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x) {
      const bool turn = y % 4 == 1 ? x == kWidth - 1 : y % 4 == 3 && x == 0;
      const bool winds = y % 2 == 0 || turn;
      depth[static_cast<std::size_t>(y * kWidth + x)] = (winds ? 0.4f : 0.6f) + 1e-5f * static_cast<float>(y);
    }
  const sdf::Grid grid{16, 16, 16, 0.004, {-0.03, -0.03, -0.03}};
  std::vector<unsigned char> mask(depth.size());
  for (int x = 290; x < 310; ++x) mask[static_cast<std::size_t>(x)] = 1;
  const Rigidd T_cam_obj{Mat3d::identity(), {0, -0.02, 0.4}};
  Reconstruction cpu(grid, nullptr, {}), gpu(grid, nullptr, {}, nullptr, 1, nullptr, cuda_devices()[0]);
  reconstruction::FrameEvidence frame{{depth.data(), kWidth, kHeight}, {0, 0, kWidth, kHeight}};
  for (Reconstruction* one : {&cpu, &gpu}) {
    frame.mask = mask.data();
    one->fuse(frame, camera, T_cam_obj, 1);
    frame.mask = nullptr;
    for (int k = 0; k < 2; ++k) one->fuse(frame, camera, T_cam_obj, 1);
  }
  expect_same(cpu, gpu);
}

TEST_F(DeviceVolume, grows_and_goes_on_as_the_cpu_does) {
  const BallFrames frames;
  Reconstruction cpu = frames.begun(40, kVoxel_m), gpu = frames.begun(40, kVoxel_m, cuda_devices()[0]);
  for (int k = 0; k < 2; ++k) frames.fuse(k, &cpu), frames.fuse(k, &gpu);
  const auto larger_cpu = cpu.grown({1, 0, 0}, {0, 0, 2}, 1), larger_gpu = gpu.grown({1, 0, 0}, {0, 0, 2}, 1);
  expect_same(*larger_cpu, *larger_gpu);
  const auto next_cpu = larger_cpu->continued(nullptr, 1), next_gpu = larger_gpu->continued(nullptr, 1);
  frames.fuse(2, next_cpu.get()), frames.fuse(2, next_gpu.get());
  expect_same(*next_cpu, *next_gpu);
}

// How many blocks of 8^3 voxels come to the host in `ask`. What was there is spoilt.
template <class Ask>
int brought(const Reconstruction& gpu, const Ask& ask) {
  const auto held = gpu.phi();
  std::fill_n(const_cast<float*>(held.data()), held.size(), std::numeric_limits<float>::quiet_NaN());
  ask();
  const levelset::BlockLattice blocks(gpu.grid());
  std::vector<bool> came(static_cast<std::size_t>(blocks.count()));
  const sdf::Grid& grid = gpu.grid();
  for (int z = 0; z < grid.nz; ++z)
    for (int y = 0; y < grid.ny; ++y)
      for (int x = 0; x < grid.nx; ++x)
        if (!std::isnan(held[grid.index(x, y, z)]))
          came[static_cast<std::size_t>(blocks.at(x / 8, y / 8, z / 8))] = true;
  return static_cast<int>(std::count(came.begin(), came.end(), true));
}

TEST_F(DeviceVolume, brings_to_the_host_what_has_changed_when_asked) {
  const BallFrames frames;
  Reconstruction gpu = frames.begun(43, kVoxel_m, cuda_devices()[0]);
  for (int k = 0; k < 8; ++k) frames.fuse(k, &gpu);
  const std::vector<float> before(gpu.phi().begin(), gpu.phi().end());
  EXPECT_EQ(brought(gpu, [&] { static_cast<void>(gpu.phi()); }), 0);
  EXPECT_EQ(brought(gpu, [&] { frames.fuse(8, &gpu); }), 0);
  const int all = levelset::BlockLattice(gpu.grid()).count();
  const int changed = brought(gpu, [&] { frames.fuse(9, &gpu), static_cast<void>(gpu.phi()); });
  EXPECT_GT(changed, 0);
  EXPECT_LT(changed, all);
}

// While it is on its way, the next frame may begin.
TEST_F(DeviceVolume, goes_on_while_blocks_are_on_their_way) {
  const BallFrames frames;
  Reconstruction cpu = frames.begun(40, kVoxel_m), gpu = frames.begun(40, kVoxel_m, cuda_devices()[0]);
  for (int k = 0; k < 6; ++k) {
    frames.fuse(k, &cpu), frames.fuse(k, &gpu);
    gpu.begin_to_show();
    if (k % 2) expect_same(cpu, gpu);
  }
}

}  // namespace
}  // namespace sdftrack
