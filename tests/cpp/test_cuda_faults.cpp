// SPDX-License-Identifier: MIT
// Every user of the GPU on the stand-in: in random orders, with calls that fail, on a second device. Each
// gives the bits that it gives without, or an exception that names the call, after which it can be used
// again.
#ifdef SDFTRACK_CUDA_ON_CPU
#include <gtest/gtest.h>

#include <cstdlib>
#include <functional>
#include <random>
#include <thread>

#include "base/cuda_probe.h"
#include "base/device_buffer.h"
#include "base/volume_id.h"
#include "contour/evolution.h"
#include "control.h"
#include "energies/cuda_work.h"
#include "frame/points_cuda.h"
#include "levelset/evolve.h"
#include "lwpr/model.h"
#include "point_fixture.h"
#include "render/raycast_mesh.h"
#include "render/raycast_sdf.h"
#include "superpixels/slic.h"
#include "term_fixture.h"

namespace sdftrack {
namespace {

using Numbers = std::vector<double>;
using Field = energies::SingleObject<float>;
using Penalty = energies::DepthLogistic<float>;

// Two frames with one CudaWork, as a tracker has it: the second has more pixels and another volume.
Numbers sums_of_frames(energies::CudaWork* work) {
  using Gpu = energies::CudaOps<Field, Penalty>;
  Numbers out;
  for (const int count : {40, 300}) {
    energies::PixelSet pixels = some_pixels(count);
    auto term = term_on<Field, Penalty>(work->upload(pixels), energies::Residual::kRayHit, true, 1);
    term.field.sdf.id = static_cast<std::uint64_t>(count);
    on_device(work, &term.field);
    Gpu::settle(work, term, 2);
    const auto sums = Gpu::linearize(work, term);
    out.push_back(sums.cost);
    out.insert(out.end(), sums.hessian, sums.hessian + 21);
    out.push_back(Gpu::cost(work, term));
    work->download(&pixels);
    out.insert(out.end(), pixels.hit_m.begin(), pixels.hit_m.end());
  }
  return out;
}

Numbers labels_of_picture(int device) {
  constexpr int kWidth = 24, kHeight = 16;
  std::vector<std::uint8_t> bytes(kWidth * kHeight * 3);
  std::minstd_rand random(3);
  for (auto& b : bytes) b = static_cast<std::uint8_t>(random() >> 8);
  superpixels::SlicImage image;
  image.bytes = bytes.data(), image.width = kWidth, image.height = kHeight;
  superpixels::SlicOptions options;
  options.n_segments = 12, options.max_iterations = 3;
  std::vector<int> labels(kWidth * kHeight);
  superpixels::slic_cuda(image, options, device, labels.data());
  return {labels.begin(), labels.end()};
}

Numbers predictions(int device) {
  static const lwpr::LwprModel model = [] {
    lwpr::LwprModel made(2, 2, lwpr::LwprOptions(), {1, 1}, {1, 1});
    std::minstd_rand random(5);
    for (int k = 0; k < 200; ++k) {
      const double x[2] = {random() % 1000 / 500.0 - 1, random() % 1000 / 500.0 - 1};
      const double y[2] = {std::sin(3 * x[0]) + x[1], x[0] * x[1]};
      made.update(x, y, 1, 1);
    }
    return made;
  }();
  Numbers x, mean(300);
  std::minstd_rand random(9);
  for (int k = 0; k < 300; ++k) x.push_back(random() % 1000 / 500.0 - 1);
  model.predict_cuda(x.data(), 150, device, mean.data());
  return mean;
}

Numbers evolved(int device) {
  constexpr int kWidth = 20, kHeight = 18;
  contour::ContourGrid grid;
  grid.nx = kWidth, grid.ny = kHeight, grid.inside = {0, 0, kWidth - 1, kHeight - 1};
  contour::EvolutionWork work;
  for (int i = 0; i < kWidth * kHeight; ++i) {
    grid.phi.push_back(static_cast<float>(std::hypot(i % kWidth - 9, i / kWidth - 8) - 5));
    work.foreground.push_back(static_cast<float>(i * 37 % 100) / 100);
  }
  contour::find_band(grid, contour::ContourOptions().band, &work.band);
  contour::ContourGrid other = grid;
  contour::evolve_contour({}, 4, &work, &other);  // on the CPU
  work.device = device;
  contour::evolve_contour({}, 4, &work, &grid);
  EXPECT_EQ(grid.phi, other.phi);
  return {grid.phi.begin(), grid.phi.end()};
}

Numbers evolved_volume(int device) {
  const sdf::Grid grid{9, 8, 7, 0.01, {0, 0, 0}};
  std::vector<float> phi, ratio;
  for (std::size_t i = 0; i < grid.size(); ++i) {
    phi.push_back(static_cast<float>(i * 37 % 100) / 3000 - 0.015f);
    ratio.push_back(static_cast<float>(i * 53 % 100) / 20 - 2.5f);
  }
  const std::vector<float> out = levelset::evolve_cuda(grid, phi.data(), ratio.data(), 4, {}, device);
  EXPECT_EQ(out, levelset::evolve(grid, phi.data(), ratio.data(), 4, {}, 1));
  return {out.begin(), out.end()};
}

Numbers summed(int device) {
  energies::CudaWork work(device);
  return sums_of_frames(&work);
}

Numbers image_of_box(int device) {
  Camera camera{{60, 62, 20.3, 14.6}, 40, 30, {0.1, -0.05, 0.002, -0.001}};
  SdfView sdf = kBox.view();
  static const std::uint64_t id = new_volume_id();
  sdf.id = id;
  const Rigidd T_cam_obj{rotation_exp(Vec3d{0.5, -0.4, 0.3}), {0.01, -0.02, 0.3}};
  const render::SdfImage image = render::raycast_sdf_cuda(sdf, camera, T_cam_obj, device);
  EXPECT_EQ(image.depth_m, render::raycast_sdf(sdf, camera, T_cam_obj, 1).depth_m);
  Numbers out(image.depth_m.begin(), image.depth_m.end());
  out.insert(out.end(), image.normals_cam.begin(), image.normals_cam.end());
  return out;
}

// A PointsOnDevice goes from one scene to the next, as a tracker's does.
Numbers sums_at_poses(int device) {
  energies::CudaWork work(device);
  frame::PointsOnDevice points(&work);
  Numbers out;
  for (const int count : {20, 530}) {
    const PointScene scene(count);
    std::vector<frame::PoseOf> poses;
    for (const Rigidf& T : poses_near(3)) poses.push_back({T, 0});
    std::vector<energies::Sums<double, 6>> sums;
    std::vector<frame::QuickCost> costs;
    points.begin();
    points.linearize({scene.terms()}, poses, &sums);
    points.cost({scene.terms()}, poses, &costs);
    for (std::size_t k = 0; k < poses.size(); ++k) {
      out.insert(out.end(), sums[k].gradient, sums[k].gradient + 6);
      out.insert(out.end(), {costs[k].readings, costs[k].surface, costs[k].outline});
    }
  }
  return out;
}

Numbers image_of_mesh(int device) {
  const Camera camera{{60, 62, 20.3, 14.6}, 40, 30, {0.1, -0.05, 0.002, -0.001}};
  const std::vector<Vec3d> corners{{-0.05, -0.03, 0}, {0.05, -0.03, 0.01}, {0, 0.05, -0.01}, {0, 0, 0.06}};
  const std::vector<sdf::Face> faces{{0, 1, 2}, {0, 3, 1}, {1, 3, 2}, {2, 3, 0}, {0, 1, 2}};
  const std::vector<std::uint8_t> colors{250, 10, 20, 30, 240, 50, 60, 70, 230, 90, 100, 110};
  const sdf::MeshView mesh{corners.data(), corners.size(), faces.data(), faces.size()};
  const sdf::Bvh bvh(mesh);
  static const std::uint64_t id = new_volume_id();
  const Rigidd T_cam_obj{rotation_exp(Vec3d{0.5, -0.4, 0.3}), {0.01, -0.02, 0.3}};
  const render::MeshImage image =
      render::raycast_mesh_cuda(mesh, bvh, id, colors.data(), camera, T_cam_obj, device);
  const render::MeshImage other = render::raycast_mesh(mesh, bvh, colors.data(), camera, T_cam_obj, 1);
  EXPECT_EQ(image.depth_m, other.depth_m);
  EXPECT_EQ(image.colors, other.colors);
  Numbers out(image.depth_m.begin(), image.depth_m.end());
  out.insert(out.end(), image.normals_cam.begin(), image.normals_cam.end());
  return out;
}

struct User {
  const char* name;
  Numbers (*run)(int device);
};

class CudaFaults : public testing::TestWithParam<User> {
 protected:
  void TearDown() override { cuda_on_cpu::reset({}); }
};

cuda_on_cpu::Settings with_seed(std::uint64_t seed, int devices = 1) {
  cuda_on_cpu::Settings settings;
  settings.seed = seed, settings.devices = devices;
  settings.early = static_cast<double>(seed % 10) / 10;
  settings.late_pageable = seed % 2 == 1;
  return settings;
}

// SDFTRACK_ORDERS: how many; more than in CI for a long run.
std::uint64_t orders() {
  const char* const given = std::getenv("SDFTRACK_ORDERS");
  return given ? std::strtoull(given, nullptr, 10) : 200;
}

TEST_P(CudaFaults, every_order_gives_the_same_bits) {
  cuda_on_cpu::reset(with_seed(0));
  const Numbers wanted = GetParam().run(0);
  for (std::uint64_t seed = 1; seed < orders(); ++seed) {
    cuda_on_cpu::reset(with_seed(seed));
    ASSERT_EQ(GetParam().run(0), wanted) << "seed " << seed;
  }
}

TEST_P(CudaFaults, a_second_device_gives_the_same_bits) {
  cuda_on_cpu::reset(with_seed(0, 2));
  const Numbers wanted = GetParam().run(0);
  for (std::uint64_t seed = 1; seed < 20; ++seed) {
    cuda_on_cpu::reset(with_seed(seed, 2));
    ASSERT_EQ(GetParam().run(1), wanted) << "seed " << seed;
    ASSERT_EQ(GetParam().run(0), wanted) << "seed " << seed;
  }
  EXPECT_THROW(GetParam().run(2), CudaError);
}

TEST_P(CudaFaults, each_call_may_fail_and_the_next_run_is_right) {
  for (const cudaError_t error : {cudaErrorMemoryAllocation, cudaErrorLaunchOutOfResources}) {
    cuda_on_cpu::reset(with_seed(3));
    const Numbers wanted = GetParam().run(0);
    cuda_on_cpu::reset(with_seed(3));
    static_cast<void>(GetParam().run(0));
    const std::int64_t calls = cuda_on_cpu::calls();
    for (std::int64_t k = 0; k < calls; ++k) {
      cuda_on_cpu::fail_call(k, error);
      try {
        ASSERT_EQ(GetParam().run(0), wanted);
        // Memory that was full was made free; or the wait at the end of a scope failed, where all is done.
        const std::string call = cuda_on_cpu::failed_call();
        EXPECT_TRUE(call == "cudaMalloc" || call == "cudaStreamSynchronize")
            << call << " failed, and nobody was told";
      } catch (const CudaError& e) {
        EXPECT_NE(std::string(e.what()).find(cudaGetErrorName(error)), std::string::npos) << e.what();
        EXPECT_EQ(std::string(e.what()).find("CUDA: "), 0u) << e.what();
      }
      cuda_on_cpu::fail_call(-1, error);
      ASSERT_EQ(GetParam().run(0), wanted) << "after call " << k;
    }
  }
}

TEST_P(CudaFaults, nothing_is_left_behind) {
  cuda_on_cpu::reset(with_seed(1));
  static_cast<void>(GetParam().run(0));
  const std::size_t before = cuda_on_cpu::bytes_in_use();
  for (int k = 0; k < 20; ++k) static_cast<void>(GetParam().run(0));
  EXPECT_EQ(cuda_on_cpu::bytes_in_use(), before);
}

TEST_P(CudaFaults, several_host_threads_get_the_same_bits) {
  cuda_on_cpu::reset(with_seed(1));
  const Numbers wanted = GetParam().run(0);
  std::vector<Numbers> got(4);
  std::vector<std::thread> threads;
  for (Numbers& one : got) threads.emplace_back([&one] { one = GetParam().run(0); });
  for (std::thread& thread : threads) thread.join();
  for (const Numbers& one : got) EXPECT_EQ(one, wanted);
}

INSTANTIATE_TEST_SUITE_P(Users, CudaFaults,
                         testing::Values(User{"sums", &summed}, User{"labels", &labels_of_picture},
                                         User{"predictions", &predictions}, User{"contour", &evolved},
                                         User{"volume", &evolved_volume}, User{"image", &image_of_box},
                                         User{"mesh", &image_of_mesh}, User{"poses", &sums_at_poses}),
                         [](const auto& info) { return std::string(info.param.name); });

// One CudaWork goes on after each failure, as a tracker's does.
TEST(CudaWorkFaults, the_frame_after_a_failure_is_right) {
  cuda_on_cpu::reset(with_seed(2));
  energies::CudaWork fresh;
  const Numbers wanted = sums_of_frames(&fresh);
  for (std::int64_t k = 0; k < 60; ++k) {
    energies::CudaWork work;
    cuda_on_cpu::fail_call(k, cudaErrorMemoryAllocation);
    try {
      ASSERT_EQ(sums_of_frames(&work), wanted);
    } catch (const CudaError&) {
    }
    cuda_on_cpu::fail_call(-1, cudaSuccess);
    ASSERT_EQ(sums_of_frames(&work), wanted) << "after call " << k;
  }
  cuda_on_cpu::reset({});
}

TEST(CudaWorkFaults, a_volume_is_sent_again_when_its_values_are_others) {
  cuda_on_cpu::reset(with_seed(2));
  energies::CudaWork work;
  std::vector<float> phi(8, 1.0f);
  SdfView view{phi.data(), 2, 2, 2, 0.01f, {}};
  view.id = 1;
  const float* const first = work.volume(view).phi;
  EXPECT_EQ(work.volume(view).phi, first);
  view.id = 2;  // another volume at the same address
  EXPECT_NE(work.volume(view).phi, first);
  std::size_t most = 0;
  for (std::uint64_t id = 3; id < 600; ++id) {
    view.id = id;
    work.volume(view);
    most = std::max(most, cuda_on_cpu::bytes_in_use());
  }
  const std::size_t before = cuda_on_cpu::bytes_in_use();
  for (std::uint64_t id = 600; id < 900; ++id) {
    view.id = id;
    work.volume(view);
  }
  EXPECT_EQ(cuda_on_cpu::bytes_in_use(), before);  // the oldest ones have gone
  cuda_on_cpu::reset({});
}

}  // namespace
}  // namespace sdftrack
#endif
