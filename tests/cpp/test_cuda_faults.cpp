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

#include "ball_frames.h"
#include "base/cuda_probe.h"
#include "base/device_buffer.h"
#include "base/volume_id.h"
#include "box_scene.h"
#include "contour/evolution.h"
#include "control.h"
#include "energies/cuda_work.h"
#include "frame/points_cuda.h"
#include "joint_scene.h"
#include "levelset/evolve.h"
#include "levelset/redistance.h"
#include "levelset/zero_mesh.h"
#include "lwpr/model.h"
#include "point_fixture.h"
#include "render/raycast_mesh.h"
#include "render/raycast_sdf.h"
#include "sdf/redistance.h"
#include "superpixels/slic.h"
#include "superpixels/slic_memory.h"
#include "term_fixture.h"
#include "tracking/fit/single_fits.h"

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
  model.predict_cuda(x.data(), 150, device, mean.data(), 40);  // piece by piece
  Numbers together(300);
  model.predict_cuda(x.data(), 150, device, together.data());
  EXPECT_EQ(mean, together);
  return mean;
}

// Learns on the device, from nothing and then beside what the CPU has learnt.
Numbers learnt(int device) {
  lwpr::LwprOptions options;
  options.init_D = {900}, options.add_threshold = 0.95, options.w_prune = 0.6;
  lwpr::LwprModel model(4, 2, options, {1, 1, 1, 1}, {1, 1});
  std::minstd_rand random(5);
  const auto learn = [&](int count, bool on_device) {
    Numbers x, y;
    for (int k = 0; k < count; ++k) {
      for (int j = 0; j < 4; ++j) x.push_back(random() % 1000 / 5000.0);
      y.push_back(std::sin(30 * x[x.size() - 4]) + x.back()), y.push_back(x.back() * x[x.size() - 2]);
    }
    const auto n = static_cast<std::size_t>(count);
    on_device ? model.update_cuda(x.data(), y.data(), n, device) : model.update(x.data(), y.data(), n, 1);
  };
  learn(90, true);
  learn(5, false);
  learn(20, true);
  const std::string bytes = model.bytes();
  return {bytes.begin(), bytes.end()};
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
  const sdf::Grid grid{9, 8, 11, 0.01, {0, 0, 0}};  // of more slices than a thread takes at a time
  std::vector<float> phi, ratio;
  for (std::size_t i = 0; i < grid.size(); ++i) {
    phi.push_back(static_cast<float>(i * 37 % 100) / 3000 - 0.015f);
    ratio.push_back(static_cast<float>(i * 53 % 100) / 20 - 2.5f);
  }
  const std::vector<float> out = levelset::evolve_cuda(grid, phi.data(), ratio.data(), 4, {}, device);
  EXPECT_EQ(out, levelset::evolve(grid, phi.data(), ratio.data(), 4, {}, 1));
  return {out.begin(), out.end()};
}

// A slope before a volume of a few blocks, parts of blocks among them: two frames, one with a mask and one by
// colour and depth, above a plane.
Numbers fused(int device) {
  const Camera camera{{30, 30, 7.5, 5.5}, 16, 12, {}};
  std::vector<float> depth, foreground;
  std::vector<unsigned char> rgb;
  for (int i = 0; i < 16 * 12; ++i) {
    depth.push_back(0.4f + 0.002f * static_cast<float>(i % 16));
    foreground.push_back(i % 7 == 0 ? 0.2f : 0.8f);
    for (int k = 0; k < 3; ++k) rgb.push_back(static_cast<unsigned char>(37 * i + 80 * k));
  }
  const std::vector<unsigned char> mask(depth.size(), 1);
  const Rigidd T_cam_obj{Mat3d::identity(), {0, 0, 0.4}};
  const reconstruction::FirstView view(camera, T_cam_obj, std::vector<float>(depth.size()),
                                       {{{0, -1, 0}, 0.03, 0.002}}, {{0, 0, 0.4}, 0.05});
  levelset::EvidenceVolume evidence({11, 9, 10, 0.01, {-0.05, -0.04, -0.05}}, nullptr);
  levelset::DeviceVolume volume(&evidence, device);
  reconstruction::DeviceRoles roles(&volume, &view);
  levelset::EvidenceOptions options;
  options.form.sigma_d_m = options.noise.noise_m = options.noise.usual_m = 0.01f;
  levelset::FrameEvidence frame{{depth.data(), 16, 12}, {0, 0, 16, 12}};
  frame.rgb = rgb.data();
  for (const bool by_mask : {true, false}) {
    frame.mask = by_mask ? mask.data() : nullptr, frame.foreground = by_mask ? nullptr : foreground.data();
    volume.send(frame);
    roles.find(camera, T_cam_obj, {});
    volume.fuse(camera, T_cam_obj, {}, options);
    volume.update(1, 2, by_mask);
    volume.begin_to_show();
  }
  volume.sweep_far(2);
  volume.fill_far(2, 0, 10);
  volume.settle();
  const std::span<const float> phi = volume.phi();
  Numbers out(phi.begin(), phi.end());
  volume.download(&evidence, 1);
  out.insert(out.end(), evidence.log_ratio().begin(), evidence.log_ratio().end());
  for (const auto& color : evidence.colors()) out.push_back(color.r), out.push_back(color.seen);
  out.push_back(volume.change_m());
  EXPECT_GT(volume.surface_boxes().size(), 0u);
  return out;
}

Numbers summed(int device) {
  energies::CudaWork work(device);
  return sums_of_frames(&work);
}

// Two frames with other numbers of pixels, as PoseFitter has them.
Numbers fitted(int device) {
  static const Camera camera = small_camera();
  static const std::vector<Rigidd> poses{pose_at({-0.1, 0, 0.95}), pose_at({0.5, 0.1, 1})};
  static const BoxImage image = image_of(camera, poses, 0, false);
  static const frame::Shape shape = frame::make_shape(box_volume().view(), 1, 1);
  const frame::DepthFrame frame{{image.depth_m.data(), camera.width, camera.height}, nullptr, nullptr};
  tracking::SingleFits fits(device);
  Numbers out;
  for (const int pixels : {20, 90}) {
    tracking::SingleFitOptions options;
    options.tracker.max_pixels = pixels, options.rules.max_steps = 2;
    for (const tracking::SingleFit& fit : fits.run(frame, camera, {&shape, &shape}, poses, options, 1)) {
      out.insert(out.end(),
                 {fit.T_cam_obj.t.x, fit.T_cam_obj.t.z, fit.T_cam_obj.R.r0.y, fit.cost, 1.0 * fit.hits});
      out.insert(out.end(), fit.covariance.data(), fit.covariance.data() + 36);
    }
  }
  return out;
}

// Two groups with one CudaWork: the second is larger.
Numbers fitted_together(int device) {
  energies::CudaWork work(device);
  Numbers out;
  for (const int objects : {2, 3}) {
    const JointScene scene(objects, {}, true, 40 * objects);
    energies::JointTask task = scene.task();
    task.rules.max_steps = 1;
    energies::JointFound found;
    energies::fit_together(&work, task, &found);
    for (int k = 0; k < objects; ++k)
      out.insert(out.end(), {found.T_obj_cam[k].t.x, found.T_obj_cam[k].t.z, found.T_obj_cam[k].R.r0.y});
    out.push_back(found.cost);
  }
  return out;
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

// Two volumes, the second larger: blocks of voxels and parts of blocks, each of which has some of the
// surface.
Numbers zero_set(int device) {
  Numbers out;
  for (const int side : {5, 9}) {
    const sdf::Grid grid{side, side - 2, side + 1, 1, {0, 0, 0}};
    std::vector<float> phi;
    for (std::size_t i = 0; i < grid.size(); ++i) phi.push_back(static_cast<float>(i * 37 % 101) - 40);
    const levelset::ZeroMesh mesh = levelset::zero_mesh_cuda(grid, phi.data(), device);
    EXPECT_GT(mesh.faces.size(), 0u);
    out.insert(out.end(), mesh.vertices.begin(), mesh.vertices.end());
    out.insert(out.end(), mesh.faces.begin(), mesh.faces.end());
  }
  return out;
}

Numbers redistanced(int device) {
  Numbers out;
  for (const int side : {4, 9}) {
    const sdf::Grid grid{side, side - 1, 4, 0.01, {0.1, 0, -0.2}};
    std::vector<float> phi;
    for (int i = 0; i < static_cast<int>(grid.size()); ++i)
      phi.push_back(static_cast<float>(i % side) - 0.3f + static_cast<float>(i * 37 % 101) / 300);
    const std::vector<float> u = levelset::redistance_cuda(grid, phi.data(), device);
    EXPECT_EQ(u, sdf::redistance(grid, phi.data(), 1));
    out.insert(out.end(), u.begin(), u.end());
  }
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
  const Numbers requested = GetParam().run(0);
  for (std::uint64_t seed = 1; seed < orders(); ++seed) {
    cuda_on_cpu::reset(with_seed(seed));
    ASSERT_EQ(GetParam().run(0), requested) << "seed " << seed;
  }
}

TEST_P(CudaFaults, a_second_device_gives_the_same_bits) {
  cuda_on_cpu::reset(with_seed(0, 2));
  const Numbers requested = GetParam().run(0);
  for (std::uint64_t seed = 1; seed < 20; ++seed) {
    cuda_on_cpu::reset(with_seed(seed, 2));
    ASSERT_EQ(GetParam().run(1), requested) << "seed " << seed;
    ASSERT_EQ(GetParam().run(0), requested) << "seed " << seed;
  }
  EXPECT_THROW(GetParam().run(2), CudaError);
}

TEST_P(CudaFaults, each_call_may_fail_and_the_next_run_is_right) {
  for (const cudaError_t error : {cudaErrorMemoryAllocation, cudaErrorLaunchOutOfResources}) {
    cuda_on_cpu::reset(with_seed(3));
    const Numbers requested = GetParam().run(0);
    cuda_on_cpu::reset(with_seed(3));
    static_cast<void>(GetParam().run(0));
    const std::int64_t calls = cuda_on_cpu::calls();
    for (std::int64_t k = 0; k < calls; ++k) {
      cuda_on_cpu::fail_call(k, error);
      try {
        ASSERT_EQ(GetParam().run(0), requested);
        // Memory that was full was made free; or the wait at the end of a scope failed, where all is done.
        const std::string call = cuda_on_cpu::failed_call();
        EXPECT_TRUE(call == "cudaMalloc" || call == "cudaStreamSynchronize")
            << call << " failed, and nobody was told";
      } catch (const CudaError& e) {
        EXPECT_NE(std::string(e.what()).find(cudaGetErrorName(error)), std::string::npos) << e.what();
        EXPECT_EQ(std::string(e.what()).find("CUDA: "), 0u) << e.what();
      }
      cuda_on_cpu::fail_call(-1, error);
      ASSERT_EQ(GetParam().run(0), requested) << "after call " << k;
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
  const Numbers requested = GetParam().run(0);
  std::vector<Numbers> got(4);
  std::vector<std::thread> threads;
  for (Numbers& one : got) threads.emplace_back([&one] { one = GetParam().run(0); });
  for (std::thread& thread : threads) thread.join();
  for (const Numbers& one : got) EXPECT_EQ(one, requested);
}

INSTANTIATE_TEST_SUITE_P(Users, CudaFaults,
                         testing::Values(User{"sums", &summed}, User{"labels", &labels_of_picture},
                                         User{"predictions", &predictions}, User{"learning", &learnt},
                                         User{"contour", &evolved}, User{"volume", &evolved_volume},
                                         User{"fits", &fitted}, User{"together", &fitted_together},
                                         User{"reconstruction", &fused}, User{"image", &image_of_box},
                                         User{"mesh", &image_of_mesh}, User{"poses", &sums_at_poses},
                                         User{"surface", &zero_set}, User{"redistance", &redistanced}),
                         [](const auto& info) { return std::string(info.param.name); });

class OneUser : public testing::Test {
 protected:
  void SetUp() override { cuda_on_cpu::reset(with_seed(2)); }
  void TearDown() override { cuda_on_cpu::reset({}); }
};
using CudaWorkFaults = OneUser;
using DeviceVolumeFaults = OneUser;

// One CudaWork goes on after each failure, as a tracker's does.
TEST_F(CudaWorkFaults, the_frame_after_a_failure_is_right) {
  energies::CudaWork fresh;
  const Numbers requested = sums_of_frames(&fresh);
  for (std::int64_t k = 0; k < 60; ++k) {
    energies::CudaWork work;
    cuda_on_cpu::fail_call(k, cudaErrorMemoryAllocation);
    try {
      ASSERT_EQ(sums_of_frames(&work), requested);
    } catch (const CudaError&) {
    }
    cuda_on_cpu::fail_call(-1, cudaSuccess);
    ASSERT_EQ(sums_of_frames(&work), requested) << "after call " << k;
  }
}

TEST_F(DeviceVolumeFaults, a_full_device_is_one_clear_error_and_other_volumes_go_on) {
  const BallFrames frames;
  reconstruction::Reconstruction volume = frames.begun(16, 0.009, 0);
  frames.fuse(0, &volume);
  const std::size_t before = cuda_on_cpu::bytes_in_use();
  int refused = 0;
  for (int k = 0; k < 30 && refused < 3; ++k) {
    cuda_on_cpu::fail_call(k, cudaErrorMemoryAllocation, 2);
    try {
      static_cast<void>(volume.grown({1, 0, 0}, {0, 0, 0}, 1));
    } catch (const CudaError& e) {
      if (cuda_on_cpu::failed_call() != "cudaMalloc") continue;
      const std::string_view expected = "too little free memory for a volume of 24 x 16 x 16 voxels";
      EXPECT_NE(std::string(e.what()).find(expected), std::string::npos) << e.what();
      ++refused;
    }
    EXPECT_EQ(cuda_on_cpu::bytes_in_use(), before);
  }
  EXPECT_EQ(refused, 3);
  cuda_on_cpu::fail_call(-1, cudaSuccess);
  reconstruction::Reconstruction cpu = frames.begun(16, 0.009);
  frames.fuse(0, &cpu), frames.fuse(1, &cpu), frames.fuse(1, &volume);
  const auto &a = volume.evidence().log_ratio(), &b = cpu.evidence().log_ratio();
  EXPECT_TRUE(std::equal(a.begin(), a.end(), b.begin()));
}

TEST_F(DeviceVolumeFaults, a_frame_is_sent_and_its_blocks_come_back_when_asked_for) {
  const BallFrames frames;
  reconstruction::Reconstruction volume = frames.begun(16, 0.009, 0);
  for (int k = 0; k < 4; ++k) frames.fuse(k, &volume);
  struct Counts {
    std::int64_t waits = cuda_on_cpu::waits(), kernels = cuda_on_cpu::kernels_run();
  };
  const Counts before;
  volume.begin_to_show();
  EXPECT_EQ(Counts().waits, before.waits);
  static_cast<void>(volume.phi()), static_cast<void>(volume.colors());
  EXPECT_EQ(Counts().waits, before.waits + 1);
  EXPECT_EQ(Counts().kernels, before.kernels + 1);
  volume.begin_to_show(), static_cast<void>(volume.phi());
  EXPECT_EQ(Counts().waits, before.waits + 1);
  EXPECT_EQ(Counts().kernels, before.kernels + 1);

  // Of a frame, beside its readings, the host takes which blocks hold the surface, and numbers; it waits for
  // the frame before and for those.
  const std::int64_t bytes = cuda_on_cpu::bytes_copied();
  frames.fuse(4, &volume);
  EXPECT_EQ(Counts().waits, before.waits + 3);
  const auto pixels = static_cast<std::int64_t>(frames.camera.width) * frames.camera.height;
  EXPECT_LT(cuda_on_cpu::bytes_copied() - bytes, 16 * pixels + 1000);
}

// What a tracker would send is there already while the volume lives.
TEST_F(DeviceVolumeFaults, a_tracker_takes_the_volume_where_it_lies) {
  cuda_on_cpu::reset(with_seed(2, 2));
  const BallFrames frames;
  auto volume = std::make_unique<reconstruction::Reconstruction>(frames.begun(16, 0.009, 0));
  frames.fuse(0, volume.get());
  energies::CudaWork work, elsewhere(1);
  const std::size_t before = cuda_on_cpu::bytes_in_use();
  const std::vector<float> copy(volume->phi().begin(), volume->phi().end());
  SdfView view = volume->grid().view(volume->phi().data());
  EXPECT_NE(work.volume(view).phi, view.phi);
  const energies::ColorView colors{&volume->colors().data()->r};
  EXPECT_NE(work.colors(view, colors).rgb_seen, colors.rgb_seen);
  EXPECT_EQ(cuda_on_cpu::bytes_in_use(), before);
  static_cast<void>(elsewhere.volume(view));
  EXPECT_EQ(cuda_on_cpu::bytes_in_use(), before + copy.size() * sizeof(float));
  volume.reset();
  view.phi = copy.data();
  const std::size_t without = cuda_on_cpu::bytes_in_use();
  static_cast<void>(work.volume(view));
  EXPECT_EQ(cuda_on_cpu::bytes_in_use(), without + copy.size() * sizeof(float));
}

TEST_F(CudaWorkFaults, a_volume_is_sent_again_when_its_values_are_others) {
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
  work.keep_volumes(200);
  view.id = 1000;
  const float* const kept = work.volume(view).phi;
  for (view.id = 1001; view.id < 1200; ++view.id) work.volume(view);
  view.id = 1000;
  EXPECT_EQ(work.volume(view).phi, kept);
}

TEST(SlicInputs, arrive_where_they_were_said_to_in_any_pieces) {
  if (cuda_devices().empty()) GTEST_SKIP() << "no CUDA device";
  std::vector<std::vector<std::uint8_t>> arrays;
  for (const std::size_t n : {40, 100, 0, 7, 64, 16, 200}) {
    arrays.emplace_back(n);
    for (std::size_t k = 0; k < n; ++k) arrays.back()[k] = static_cast<std::uint8_t>(31 * arrays.size() + k);
  }
  for (const std::size_t piece : {16, 32, 64, 128, 4096}) {
    superpixels::SlicInputs inputs(piece, 48);
    std::vector<std::size_t> places;
    for (const auto& array : arrays) places.push_back(inputs.add(array));
    const DeviceStream stream;
    PinnedBuffer<std::byte> pinned(piece);
    DeviceBuffer<std::byte> there(inputs.bytes());
    inputs.send(stream, pinned.data(), there.data());
    std::vector<std::uint8_t> back(inputs.bytes());
    stream.download(reinterpret_cast<const std::uint8_t*>(there.data()), back.size(), back.data());
    stream.wait();
    for (std::size_t k = 0; k < arrays.size(); ++k) {
      EXPECT_EQ(places[k] % superpixels::SlicInputs::kAlign, 0u);
      EXPECT_TRUE(std::equal(arrays[k].begin(), arrays[k].end(), back.data() + places[k])) << piece;
    }
  }
}

}  // namespace
}  // namespace sdftrack
#endif
