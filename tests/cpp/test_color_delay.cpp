// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "tracking/trust/color_delay.h"

namespace sdftrack {
namespace {

constexpr double kDelay_s = 0.02, kStep_s = 1.0 / 30;

struct Sequence {
  tracking::Vector6d bias = tracking::Vector6d::Zero();
  double noise = 0;  // sds
  double speed = 1;
};

tracking::ColorDelay delay_of(const Sequence& s, int frames = 200) {
  tracking::Vector6d sd;
  sd << 0.0005, 0.0005, 0.005, 0.02, 0.02, 0.01;
  std::mt19937 random(1);
  std::normal_distribution<double> normal;
  tracking::ColorDelay delay;
  const auto velocity_at = [&](double t) {
    tracking::Vector6d v;
    v << 0.2 * std::cos(2 * t), 0.1 * std::sin(3 * t), 0.1 * std::cos(t), std::sin(t), 0.5, std::cos(3 * t);
    return tracking::Vector6d(s.speed * v);
  };
  for (int i = 0; i < frames; ++i) {
    tracking::PosesApart apart;
    apart.covariance = sd.cwiseAbs2().asDiagonal();
    apart.way = s.bias + kDelay_s * velocity_at(i * kStep_s);
    for (int k = 0; k < 6; ++k) apart.way[k] += s.noise * sd[k] * normal(random);
    delay.observe(apart, velocity_at((i - 0.5) * kStep_s));  // since the frame before
  }
  return delay;
}

tracking::ColorDelay::Estimate estimate_of(const Sequence& s, int frames = 200) {
  return delay_of(s, frames).estimate();
}

TEST(ColorDelay, exact_ways_give_the_delay_whatever_the_bias) {
  Sequence s;
  s.bias << 0.004, -0.002, 0.01, 0.02, 0, -0.03;
  const auto found = estimate_of(s);
  EXPECT_NEAR(found.delay_s, kDelay_s, 1e-4);
  EXPECT_EQ(found.frames, 199);  // the last one waits for the next
}

TEST(ColorDelay, without_a_motion_nothing_is_known) {
  Sequence s;
  s.noise = 1, s.speed = 0;
  EXPECT_GT(estimate_of(s).sd_s, 0.05);
  EXPECT_EQ(estimate_of(s, 5).frames, 0);
}

TEST(ColorDelay, the_lag_is_half_a_frame_until_it_is_measured) {
  Sequence s;
  s.bias << 0.004, -0.002, 0.01, 0.02, 0, -0.03;
  EXPECT_EQ(delay_of(s, 5).lag2_frames(kStep_s), 0.25);
  EXPECT_EQ(delay_of(s).lag2_frames(0), 0.25);  // no times
  EXPECT_NEAR(delay_of(s).lag2_frames(kStep_s), std::pow(kDelay_s / kStep_s, 2), 0.05);
}

}  // namespace
}  // namespace sdftrack
