// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "tracking/frame_watch.h"

namespace sdftrack {
namespace {

using tracking::ReasonCode;

constexpr int kWidth = 640, kHeight = 480;
constexpr double kNoTime = std::numeric_limits<double>::quiet_NaN();

// A slanted plane, and a sphere that stands out of it.
std::vector<float> scene(double noise_m, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal(0, 1);
  std::vector<float> z(static_cast<std::size_t>(kWidth * kHeight));
  for (int v = 0; v < kHeight; ++v)
    for (int u = 0; u < kWidth; ++u) {
      const double x = (u - 320) / 500.0, y = (v - 240) / 500.0, r2 = x * x + y * y;
      double depth = 1 / (1.1 - 0.4 * y);
      if (r2 < 0.02) depth -= 0.1 * std::sqrt(1 - r2 / 0.02);
      z[static_cast<std::size_t>(v * kWidth + u)] = static_cast<float>(depth + noise_m * normal(random));
    }
  return z;
}

struct Watched {
  tracking::FrameWatch watch;
  std::vector<unsigned char> rgb = std::vector<unsigned char>(3 * kWidth * kHeight, 100);
  appearance::ColorImage color{rgb.data(), appearance::aligned_map(kWidth, kHeight)};

  ReasonCode look(const std::vector<float>& z, double time_s = kNoTime, bool colored = false) {
    frame::DepthFrame frame{{z.data(), kWidth, kHeight}, nullptr, nullptr};
    frame.time_s = time_s;
    if (colored) frame.color = &color;
    return watch.look(frame, {{200, 150, 300, 250}}, 1.0f);
  }
};

TEST(FrameWatch, a_rendering_without_noise_may_stand_still) {
  Watched w;
  const std::vector<float> z = scene(0, 0);
  for (int i = 0; i < 3; ++i) EXPECT_EQ(w.look(z, i / 30.0), ReasonCode::kNone);
}

TEST(FrameWatch, few_readings_prove_nothing) {
  Watched w;
  std::vector<float> z = scene(0.001, 1);
  for (int i = 0; i < kWidth * kHeight; ++i)
    if (i % kWidth > 12) z[static_cast<std::size_t>(i)] = 0;
  EXPECT_EQ(w.look(z), ReasonCode::kNone);
  EXPECT_EQ(w.look(z), ReasonCode::kNone);
}

TEST(FrameWatch, the_same_frame_given_once_more_is_no_fault) {
  Watched w;
  const std::vector<float> z = scene(0.001, 1);
  w.look(z, 1.0);
  EXPECT_EQ(w.look(z, 1.0), ReasonCode::kNone);
  EXPECT_EQ(w.look(z, 1.1), ReasonCode::kRepeatedDepth);
}

TEST(FrameWatch, an_exposure_is_the_whole_images_and_a_dark_hand_is_not_one) {
  Watched w;
  unsigned seed = 0;
  const auto look = [&] { return w.look(scene(0.001, ++seed), kNoTime, true); };
  look();
  EXPECT_EQ(look(), ReasonCode::kNone);
  std::fill(w.rgb.begin(), w.rgb.end(), static_cast<unsigned char>(130));
  EXPECT_EQ(look(), ReasonCode::kExposureJump);
  EXPECT_EQ(look(), ReasonCode::kNone);
  for (int v = 150; v < 250; ++v)
    for (int k = 600; k < 900; ++k) w.rgb[static_cast<std::size_t>(3 * v * kWidth + k)] = 20;
  EXPECT_EQ(look(), ReasonCode::kNone);
}

TEST(FrameWatch, a_fault_makes_ok_weak_and_stands_behind_another_reason) {
  tracking::Status status = tracking::Status::kOk;
  tracking::Reason reason;
  double confidence = 0.9;
  doubt_frame(ReasonCode::kTimeJump, &status, &reason, &confidence);
  doubt_frame(ReasonCode::kTimeJump, &status, &reason, &confidence);
  EXPECT_EQ(status, tracking::Status::kWeak);
  EXPECT_EQ(sentence(reason), "the timestamp jumps by more than ten times the usual interval");
  EXPECT_DOUBLE_EQ(confidence, 0.45);
  reason = {ReasonCode::kPoorFit};
  doubt_frame(ReasonCode::kTimeJump, &status, &reason, &confidence);
  EXPECT_EQ(sentence(reason),
            "the depth measurements do not fit the shape well; the timestamp jumps by more than ten times "
            "the usual interval");
}

}  // namespace
}  // namespace sdftrack
