// SPDX-License-Identifier: MIT
// A frame allocates nothing once the tracker is warm, a sample nothing once the fields are there.
#include <gtest/gtest.h>

#include <atomic>
#include <cstdlib>
#include <random>

#include "box_scene.h"
#include "contour/tracker.h"
#include "lwpr/unit.h"

#ifdef __GLIBC__
extern "C" void* __libc_malloc(std::size_t size);

namespace {
std::atomic<long> allocations{0};
}

// Counts what the program and its libraries ask for, Eigen's aligned memory too; the C library's own
// functions behind it are those of every program.
extern "C" void* malloc(std::size_t size) {
  allocations.fetch_add(1, std::memory_order_relaxed);
  return __libc_malloc(size);
}

namespace sdftrack {
namespace {

constexpr int kWidth_px = 320, kHeight_px = 240;

enum class Shows { kDepth, kColors, kPaint };
class Allocations : public testing::TestWithParam<Shows> {};

TEST_P(Allocations, a_warm_tracker_allocates_nothing) {
  const bool colors = GetParam() != Shows::kDepth;
  const Camera camera{{260, 260, 159.5, 119.5}, kWidth_px, kHeight_px, {}};
  const SdfView volume = box_volume().view();
  tracking::Tracker tracker({volume, volume}, camera, {}, {});
  std::vector<std::uint16_t> paint;  // darker to one side
  for (int i = 0; i < volume.nx * volume.ny * volume.nz; ++i) {
    const auto part = static_cast<std::uint16_t>(40000 + 200 * (i % volume.nx));
    paint.insert(paint.end(), {part, 15000, 15000, 65535});
  }
  if (GetParam() == Shows::kPaint) tracker.paint(0, {paint.data(), 1});  // and the other of the same shape
  // The second box stands beside the first and is fitted together with it.
  const Rigidd first = pose_at({0.01, 0, 0.55});
  std::vector<BoxImage> images;
  std::vector<std::vector<unsigned char>> rgb;
  for (int i = 0; i < 8; ++i) {
    const Rigidd pose{rotation_exp(Vec3d{0, 0.01 * i, 0.01 * i}) * first.R,
                      first.t + Vec3d{0.001 * i, 0, 0.001 * i}};
    images.push_back(image_of(camera, {pose, beside(pose, 0.005)}, i));
    rgb.emplace_back(3 * images.back().depth_m.size(), static_cast<unsigned char>(60));
    for (std::size_t at = 0; at < images.back().depth_m.size(); ++at)
      if (images.back().depth_m[at] < kWall_m) rgb.back()[3 * at] = 200;
  }
  long counted = -1;
  for (int k = 0; k < 40; ++k) {
    const auto at = static_cast<std::size_t>(k % 14 < 8 ? k % 14 : 14 - k % 14);
    const appearance::ColorImage color{rgb[at].data(), appearance::aligned_map(kWidth_px, kHeight_px)};
    const frame::DepthFrame frame = tracker.make_frame({images[at].depth_m.data(), kWidth_px, kHeight_px},
                                                       nullptr, k / 30.0, colors ? &color : nullptr);
    const long before = allocations.load();
    const tracking::FrameResult& result =
        k == 0 ? tracker.start(frame, {at_pose(first), at_pose(beside(first, 0.005))}) : tracker.track(frame);
    counted = allocations.load() - before;
    for (const tracking::ObjectResult& object : result.objects)
      ASSERT_EQ(object.trust.status, tracking::Status::kOk)
          << tracking::sentence(object.trust.reason) << ", frame " << k;
    ASSERT_EQ(result.objects[0].color_used, colors && k > 0);
    if (k == 0) EXPECT_GT(counted, 0);  // the counter counts
    if (k >= 20) EXPECT_EQ(counted, 0) << "frame " << k;
  }
}

const char* name_of(const testing::TestParamInfo<Shows>& info) {
  if (info.param == Shows::kDepth) return "depth_alone";
  return info.param == Shows::kColors ? "with_colors" : "with_painted_shapes";
}
INSTANTIATE_TEST_SUITE_P(, Allocations, testing::Values(Shows::kDepth, Shows::kColors, Shows::kPaint),
                         name_of);

TEST(SampleAllocations, a_sample_to_fields_that_are_there_makes_none) {
  lwpr::LwprOptions options;
  options.init_D = {100};
  options.update_D = false;  // a field that grows is entered into more cells of the search
  lwpr::LwprUnit unit(lwpr::FieldLayout(2, false, false), options);
  lwpr::LwprScratch scratch;
  std::mt19937 random(1);
  std::uniform_real_distribution<double> place(-1, 1);
  const auto learn = [&](double within) {
    const double x[] = {within * place(random), within * place(random)};
    unit.update(x, std::sin(3 * x[0]) * x[1]);
    static_cast<void>(unit.predict(x, &scratch));
  };
  const long at_first = allocations.load();
  for (int i = 0; i < 20000; ++i) learn(1);
  unit.settle();
  EXPECT_GT(allocations.load(), at_first);
  const int fields = unit.size();
  const long before = allocations.load();
  for (int i = 0; i < 1000; ++i) learn(0.8);
  EXPECT_EQ(unit.size(), fields);
  EXPECT_EQ(allocations.load(), before);
}

TEST(ContourAllocations, a_warm_contour_tracker_allocates_nothing) {
  constexpr int kFrames = 6;
  std::vector<std::vector<unsigned char>> images;
  std::vector<unsigned char> mask(kWidth_px * kHeight_px);
  for (int k = 0; k < kFrames; ++k) {
    images.emplace_back(3 * kWidth_px * kHeight_px, static_cast<unsigned char>(90));
    for (int y = 0; y < kHeight_px; ++y)
      for (int x = 0; x < kWidth_px; ++x) {
        const auto at = static_cast<std::size_t>(y * kWidth_px + x);
        const bool inside = std::hypot(x - 150 - 2 * k, y - 120) < 40;
        if (inside) images.back()[3 * at] = static_cast<unsigned char>(180 + x % 40);
        if (k == 0) mask[at] = inside;
      }
  }
  contour::ContourTracker tracker{contour::ContourOptions{}};
  tracker.start(contour::RgbView{images[0].data(), kWidth_px, kHeight_px}, mask.data());
  for (int k = 1; k < 40; ++k) {
    const int at =
        k % (2 * kFrames - 2) < kFrames ? k % (2 * kFrames - 2) : 2 * kFrames - 2 - k % (2 * kFrames - 2);
    const contour::RgbView image{images[static_cast<std::size_t>(at)].data(), kWidth_px, kHeight_px};
    const long before = allocations.load();
    tracker.track(image);
    if (k >= 20) EXPECT_EQ(allocations.load() - before, 0) << "frame " << k;
    ASSERT_EQ(tracker.report().status, contour::ContourStatus::kOk) << "frame " << k;
  }
}

}  // namespace
}  // namespace sdftrack
#endif
