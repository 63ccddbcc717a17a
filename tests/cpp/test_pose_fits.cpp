// SPDX-License-Identifier: MIT
// Whole searches on the GPU against optim::minimize, and its choice of pixels against the CPU's; skipped
// where no GPU answers.
#include <gtest/gtest.h>

#include "base/cuda_probe.h"
#include "base/volume_id.h"
#include "box_scene.h"
#include "energies/outline_energy.h"
#include "energies/photometric.h"
#include "energies/pose_fits.h"
#include "energies/sdf_energy.h"
#include "frame/selection_cuda.h"
#include "optim/prior.h"
#include "term_fixture.h"
#include "tracking/fit/free_space.h"
#include "tracking/fit/single_fits.h"
#ifdef SDFTRACK_WITH_CUDA
#include "base/device_stream.h"
#endif
#ifdef SDFTRACK_CUDA_ON_CPU
#include "control.h"
#endif

namespace sdftrack {
namespace {

constexpr double kSamePose = 1e-5;  // m and rad

void expect_same_pose(const Rigidd& got, const Rigidd& requested) {
  EXPECT_LT(norm(got.t - requested.t), kSamePose);
  EXPECT_LT(rotation_angle(got.R * transpose(requested.R)), kSamePose);
}

class PoseFits : public testing::Test {
 protected:
  void SetUp() override {
    if (cuda_devices().empty()) GTEST_SKIP() << (cuda_built() ? "no CUDA device" : "a build without CUDA");
  }
};

// Readings of the box at kPose, with those of other things beside it.
energies::PixelSet box_pixels(int count) {
  energies::PixelSet pixels;
  std::mt19937 random(5);
  std::uniform_real_distribution<float> u(100, 220), v(60, 180), share(0, 1);
  std::normal_distribution<float> noise(0, 0.001f);
  while (pixels.count() < count) {
    const Vec2f at{u(random), v(random)};
    const float error = noise(random), p = share(random);
    float z = 0.3f;
    for (int k = 0; k < 60; ++k) {  // along the ray to the surface
      float phi;
      Vec3f unused;
      sample(kBox.view(), kPose * (z * ray(kCamera, at.x, at.y)), &phi, &unused);
      z += 0.9f * phi;
    }
    pixels.push(at.x, at.y, z < 0.7f ? z + error : 0.62f, 1, pixels.count(), p);
  }
  return pixels;
}

optim::State start_of(bool scale) {
  optim::State x{{increment(Vec3d{0.004, -0.003, 0.005}, Vec3d{0.03, -0.02, 0.04}) * kPose.cast<double>()},
                 kCamera.cast<double>(),
                 {}};
  if (scale) x.log_scale.push_back(0.02);
  return x;
}

struct Beside {
  energies::DistanceGrid grid;
  std::vector<Vec3f> points;
  optim::PosePrior prior{{1, false, false},
                         0,
                         increment(Vec3d{0.001, 0, 0.002}, Vec3d{0, 0.01, 0}) * kPose.cast<double>(),
                         optim::PosePrior::isotropic(0.003, 0.02)};

  Beside() {
    grid.width = 20, grid.height = 15, grid.step = 8, grid.x0 = 90, grid.y0 = 60;
    for (int i = 0; i < grid.width * grid.height; ++i)
      grid.distance_px.push_back(static_cast<float>(i % grid.width > 12 ? 8 * (i % grid.width - 12) : 0));
    for (int i = 0; i < 90; ++i)
      points.push_back({0.05f, 0.0006f * static_cast<float>(i - 45), 0.04f * (i % 2 ? 1.0f : -1.0f)});
  }
};

// Lines across the outline of the box at kPose, some of which are wrong.
energies::OutlineLines lines_of_box(bool lens) {
  energies::OutlineLines out;
  out.view.A = {{525, 0, 160}, {0, 520, 120}, {0, 0, 1}};
  if (lens) {
    out.view.A = Mat3d::identity(), out.view.K = {525, 520, 160, 120};
    out.view.has_lens = true, out.view.lens[0] = 0.1, out.view.lens[2] = 0.001;
  }
  const Rigidd T_cam_obj = inverse(kPose.cast<double>());
  std::mt19937 random(4);
  std::normal_distribution<double> noise(0, 0.4);
  for (int k = 0; k < 300; ++k) {
    const double turn = 0.021 * k, side = k % 2 ? 0.04 : -0.04;
    const Vec3d p{0.05 * std::cos(turn), 0.03 * std::sin(turn), side};
    Vec2d u;
    out.view.place(T_cam_obj * p, &u);
    const double error = noise(random);
    out.lines.push_back({p, u, {std::cos(turn), std::sin(turn)}, 0.3 + (k % 11 ? error : 5.0), 0.5});
  }
  return out;
}

enum Others { kNothing = 0, kFreeSpace = 1, kBrightness = 2, kLines = 4, kLens = 8 };

void expect_the_minimum_of_the_cpu(energies::SdfEnergyOptions options, int others, int count = 1500) {
  energies::PixelSet here = box_pixels(count), there = here;
  energies::SdfEnergy cpu(kBox.view(), &here, options), gpu(kBox.view(), &there, options);
  optim::LmResult requested, got;
  requested.x = got.x = start_of(options.scale);
  Beside beside;
  tracking::FreeSpaceEnergy free_space(&beside.points, &beside.grid, {});
  Painted painted(here), painted_there(here);
  energies::PhotometricEnergy brightness = painted.energy(got.x), to_send = painted_there.energy(got.x);
  energies::OutlineLines lines = lines_of_box(others & kLens);
  energies::OutlineEnergy outline(&lines, {1.2, others & kLens ? 0.0 : 0.5, 6});
  optim::SumEnergy sum;
  sum.add(&cpu);
  energies::Beside sent;
  if (others & kFreeSpace) {
    sum.add(&free_space, 3.0);
    sum.add(&beside.prior);
    sent.prior = beside.prior.term(), sent.outline = free_space.term(got.x), sent.outline_weight = 3.0;
  }
  if (others & kBrightness) {
    sum.add(&brightness, 0.7);
    sent.brightness = to_send.on_device(), sent.brightness_weight = 0.7;
  }
  if (others & kLines) {
    sum.add(&outline, 2.0);
    sent.lines = outline.on_device(), sent.lines_weight = 2.0;
  }
  optim::LmOptions lm;
  lm.cost_gain = 1e-3;
  cpu.settle(requested.x, 2);
  optim::LmWork work;
  optim::minimize(sum, lm, &work, &requested);
  energies::CudaWork device(cuda_devices().front());
  ASSERT_TRUE(gpu.can_search());
  gpu.search(&device, 2, lm, sent, &got);
  expect_same_pose(got.x.T_obj_cam[0], requested.x.T_obj_cam[0]);
  if (options.scale) EXPECT_NEAR(got.x.log_scale[0], requested.x.log_scale[0], 1e-4);
  EXPECT_NEAR(got.cost, requested.cost, 1e-4 * requested.cost);
  EXPECT_EQ(got.count, requested.count);
  EXPECT_EQ(got.stop, requested.stop);
  ASSERT_GT(requested.steps.size(), 1u);
  EXPECT_NEAR(static_cast<double>(got.steps.size()), static_cast<double>(requested.steps.size()), 1);
  EXPECT_NEAR(got.steps[0].cost, requested.steps[0].cost, 1e-4 * requested.steps[0].cost);
  int apart = 0;
  for (std::size_t i = 0; i < here.gain.size(); ++i) apart += std::abs(there.gain[i] - here.gain[i]) > 0.05f;
  EXPECT_LE(apart, count / 300);
}

energies::SdfEnergyOptions ray_hits() {
  energies::SdfEnergyOptions options;
  options.residual = energies::Residual::kRayHit;
  return options;
}

TEST_F(PoseFits, the_pose_is_the_cpus) {
  expect_the_minimum_of_the_cpu(ray_hits(), kNothing);
  energies::SdfEnergyOptions points;
  points.residual = energies::Residual::kPoint;
  expect_the_minimum_of_the_cpu(points, kNothing);
}

TEST_F(PoseFits, a_prior_and_free_space_count_as_on_the_cpu) {
  expect_the_minimum_of_the_cpu(ray_hits(), kFreeSpace);
}

TEST_F(PoseFits, a_scale_is_found_too) {
  energies::SdfEnergyOptions options = ray_hits();
  options.scale = true;
  expect_the_minimum_of_the_cpu(options, kNothing);
}

TEST_F(PoseFits, colours_weigh_the_pixels) {
  energies::SdfEnergyOptions options = ray_hits();
  options.color = true;
  expect_the_minimum_of_the_cpu(options, kFreeSpace);
  options.color_likelihood = energies::ColorLikelihood::kPrinted;
  expect_the_minimum_of_the_cpu(options, kNothing);
}

TEST_F(PoseFits, the_brightness_of_the_surface_counts_as_on_the_cpu) {
  expect_the_minimum_of_the_cpu(ray_hits(), kBrightness);
  expect_the_minimum_of_the_cpu(ray_hits(), kFreeSpace | kBrightness | kLines, 300);
}

TEST_F(PoseFits, the_outline_counts_as_on_the_cpu) {
  expect_the_minimum_of_the_cpu(ray_hits(), kLines);
  expect_the_minimum_of_the_cpu(ray_hits(), kLines | kLens);
}

// So many that each has one block, whose looks follow one another in one launch, and few with several blocks.
TEST_F(PoseFits, each_of_many_is_as_if_alone) {
  using Fits = energies::CudaPoseFits<energies::SingleObject<float>, energies::DepthLogistic<float>>;
  constexpr int kEach = 60, kMany = 270;
  const energies::PixelSet one = box_pixels(kEach);
  energies::PixelSet pixels;
  pixels.resize(kEach * kMany);  // for each its own: its hits and classes
  for (int i = 0; i < kEach * kMany; ++i) pixels.copy(one, i % kEach, i);
  energies::CudaWork device(cuda_devices().front());
  const energies::PixelsView<float> all = device.upload(pixels);
  auto term = term_on<energies::SingleObject<float>, energies::DepthLogistic<float>>(
      all, energies::Residual::kRayHit, false, 1);
  on_device(&device, &term.field);
  std::vector<Rigidd> few, many;
  for (const int n : {3, kMany}) {
    std::vector<Fits::Problem> problems;
    std::vector<Fits::Fit> fits(static_cast<std::size_t>(n));
    for (int k = 0; k < n; ++k) {
      const int f = k * kEach;
      Fits::Problem problem{term};
      problem.term.pixels = {kEach,           all.u_px + f,      all.v_px + f,
                             all.depth_m + f, all.per_noise + f, all.hit_m + f,
                             all.gain + f,    all.foreground + f};
      problem.settle_steps = 2, problem.rules.max_steps = 6 - k % 2;  // not all alike
      problems.push_back(problem);
      fits[static_cast<std::size_t>(k)].search.at.T_obj_cam[0] =
          increment(Vec3d{0.001 * (k % 3), 0, 0.002}, Vec3d{0, 0.02, 0}) * kPose.cast<double>();
    }
    std::vector<optim::LmStep> steps;
    EXPECT_EQ(Fits::run(&device, &problems, &fits, &steps), 6);
    for (const auto& fit : fits) {
      EXPECT_GT(fit.search.tried, 1);
      EXPECT_FALSE(fit.search.searching);
      EXPECT_GT(fit.hits, kEach / 4);
      (n == 3 ? few : many).push_back(fit.search.at.T_obj_cam[0]);
    }
    EXPECT_EQ(steps.size(), static_cast<std::size_t>(6 * n));
  }
  for (std::size_t k = 0; k < many.size(); ++k) expect_same_pose(many[k], few[k % 3]);
}

TEST_F(PoseFits, nothing_to_fit_and_nothing_to_see) {
  energies::PixelSet none;
  energies::SdfEnergy energy(kBox.view(), &none, {});
  energies::CudaWork device(cuda_devices().front());
  optim::LmResult found;
  found.x = start_of(false);
  energy.search(&device, 2, {}, {}, &found);
  EXPECT_EQ(found.stop, optim::Stop::kNoData);
  EXPECT_EQ(found.x.T_obj_cam[0].t.x, start_of(false).T_obj_cam[0].t.x);
}

#ifdef SDFTRACK_WITH_CUDA
std::vector<float> column(const float* device, int count) {
  DeviceStream stream;
  std::vector<float> out(static_cast<std::size_t>(count));
  const StreamWaiter waiter(stream);
  stream.download(device, out.size(), out.data());
  return out;
}

// Objects in the image, at its border, outside of it, and beside all readings.
std::vector<Rigidd> places() {
  return {pose_at({-0.02, 0.01, 0.55}), pose_at({0.2, 0.1, 0.6}), pose_at({0, 0, -0.5}), pose_at({5, 0, 0.6}),
          pose_at({0, 0.02, 0.02})};
}

void expect_the_cpus_pixels(const frame::DepthFrame& frame, const Camera& camera, int requested) {
  const frame::Shape shape = frame::make_shape(box_volume().view(), 1, 1);
  std::vector<frame::Lookout> lookouts;
  for (const Rigidd& T : places())
    lookouts.push_back(frame::lookout_for(frame, camera, shape, T, {0.001, 0.002}, 0.04, nullptr));
  energies::CudaWork device(cuda_devices().front());
  const frame::PixelsOnDevice chosen = frame::choose_on_device(&device, frame, lookouts, requested);
  cudaDeviceSynchronize();
  std::vector<int> counts(lookouts.size());
  {
    DeviceStream stream;
    const StreamWaiter waiter(stream);
    stream.download(chosen.counts, counts.size(), counts.data());
  }
  int found = 0;
  for (std::size_t k = 0; k < lookouts.size(); ++k) {
    frame::PixelSelection selection;
    energies::PixelSet set;
    selection.choose(frame, camera, shape, places()[k], {0.001, 0.002}, 0.04, nullptr);
    selection.pack(requested, &set);
    ASSERT_EQ(counts[k], set.count()) << k;
    found += set.count();
    const energies::PixelsView<float> view = chosen.of(k);
    ASSERT_LE(set.count(), view.count);
    EXPECT_EQ(column(view.u_px, set.count()), set.u_px);
    EXPECT_EQ(column(view.v_px, set.count()), set.v_px);
    EXPECT_EQ(column(view.depth_m, set.count()), set.depth_m);
    EXPECT_EQ(column(view.per_noise, set.count()), set.per_noise);
    EXPECT_EQ(column(view.foreground, set.count()), set.foreground);
    EXPECT_EQ(column(view.hit_m, set.count()), set.hit_m);
    EXPECT_EQ(column(view.gain, set.count()), set.gain);
  }
  EXPECT_EQ(found > 0, requested > 0);
}

TEST_F(PoseFits, the_pixels_are_the_cpus) {
  Camera camera = small_camera();
  const BoxImage image = image_of(camera, {places()[0], places()[1]}, 0, false);
  std::vector<unsigned char> mask(image.depth_m.size());
  for (std::size_t i = 0; i < mask.size(); ++i) mask[i] = i % 7 > 1;
  frame::DepthFrame frame{{image.depth_m.data(), camera.width, camera.height}, nullptr, nullptr};
  for (const int requested : {0, 1, 50, 777, 1'000'000}) expect_the_cpus_pixels(frame, camera, requested);
  frame.mask = mask.data();
  expect_the_cpus_pixels(frame, camera, 200);
  camera.distortion = {0.1, -0.05, 0.001, 0.002};
  const std::vector<float> rays = ray_table(camera);
  frame.rays = rays.data();
  expect_the_cpus_pixels(frame, camera, 200);
}

std::vector<tracking::SingleFit> fit_boxes(int device) {
  const Camera camera = small_camera();
  const std::vector<Rigidd> truth{places()[0], places()[1]};
  const BoxImage image = image_of(camera, truth, 0, false);
  const frame::DepthFrame frame{{image.depth_m.data(), camera.width, camera.height}, nullptr, nullptr};
  const frame::Shape shape = frame::make_shape(box_volume().view(), 1, 1);
  std::vector<const frame::Shape*> shapes;
  std::vector<Rigidd> starts;
  for (int k = 0; k < 5; ++k) {
    shapes.push_back(&shape);
    const Rigidd T = places()[static_cast<std::size_t>(k)];
    starts.push_back({T.R, T.t + Vec3d{0.003, -0.002, 0.004}});
  }
  tracking::SingleFits fits(device);
  tracking::SingleFitOptions options;
  options.tracker.max_pixels = 1500;
  return fits.run(frame, camera, shapes, starts, options, 1);
}

TEST_F(PoseFits, objects_of_a_frame_are_fitted_as_on_the_cpu) {
  const auto cpu = fit_boxes(-1), gpu = fit_boxes(cuda_devices().front());
  for (std::size_t k = 0; k < cpu.size(); ++k) {
    EXPECT_EQ(gpu[k].pixels, cpu[k].pixels) << k;
    EXPECT_EQ(gpu[k].stop, cpu[k].stop) << k;
    expect_same_pose(gpu[k].T_cam_obj, cpu[k].T_cam_obj);
    EXPECT_LT((gpu[k].covariance - cpu[k].covariance).norm(), 1e-2 * cpu[k].covariance.norm()) << k;
  }
  EXPECT_GT(cpu[0].hits, cpu[0].pixels / 2);
  EXPECT_NEAR(gpu[0].hits, cpu[0].hits, cpu[0].pixels / 500.0);
}
#endif

#ifdef SDFTRACK_CUDA_ON_CPU
// And once for a volume that is sent: its values are the caller's, and may change.
TEST_F(PoseFits, the_host_waits_once) {
  const std::int64_t waits = cuda_on_cpu::waits();
  static_cast<void>(fit_boxes(0));
  EXPECT_EQ(cuda_on_cpu::waits() - waits, 1 + 1);
  energies::PixelSet pixels = box_pixels(600);
  SdfView sdf = kBox.view();
  sdf.id = new_volume_id();
  energies::SdfEnergy energy(sdf, &pixels, ray_hits());
  energies::CudaWork device(0);
  optim::LmResult found;
  found.x = start_of(false);
  Painted painted(pixels);
  energies::OutlineLines lines = lines_of_box(false);
  energies::Beside sent;
  for (const int volumes : {2, 0}) {  // distances and colours are sent once
    sent.brightness = painted.energy(found.x).on_device(), sent.brightness_weight = 0.5;
    sent.brightness.term.sdf.id = sdf.id;
    sent.lines = energies::OutlineEnergy(&lines, {1, 0.5, 6}).on_device(), sent.lines_weight = 1;
    const std::int64_t before = cuda_on_cpu::waits();
    energy.search(&device, 2, {}, sent, &found);
    EXPECT_EQ(cuda_on_cpu::waits() - before, 1 + volumes);
  }
}

// What the frame needs beside the fit runs on the CPU; before, the host waited for each sum.
TEST_F(PoseFits, a_tracker_waits_once_for_each_stage) {
  const Camera camera{{300, 300, 199.5, 149.5}, 400, 300, {}};
  tracking::TrackerSettings settings;
  settings.device = 0;
  tracking::Tracker tracker({box_volume().view()}, camera, {}, settings);
  const auto frame_of = [&](const BoxImage& image) {
    return tracker.make_frame({image.depth_m.data(), camera.width, camera.height}, nullptr, 0, nullptr);
  };
  const Rigidd first = pose_at({0, 0, 0.55}), then = pose_at({0.003, 0.001, 0.552});
  const BoxImage one = image_of(camera, {first}, 0), two = image_of(camera, {then}, 1);
  tracker.start(frame_of(one), {at_pose(first)});
  const std::int64_t waits = cuda_on_cpu::waits(), kernels = cuda_on_cpu::kernels_run();
  const tracking::FrameResult& result = tracker.track(frame_of(two));
  EXPECT_LT(norm(result.objects[0].T_cam_obj.t - then.t), 5e-4);
  EXPECT_GT(cuda_on_cpu::kernels_run() - kernels, 0);
  EXPECT_GT(cuda_on_cpu::waits() - waits, 0);
  EXPECT_LE(cuda_on_cpu::waits() - waits, 4);
}
#endif

}  // namespace
}  // namespace sdftrack
