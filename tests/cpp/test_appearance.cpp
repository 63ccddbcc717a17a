// SPDX-License-Identifier: MIT
// Colours: the way from depth to colour pixels, histograms.
#include <gtest/gtest.h>

#include <numeric>

#include "appearance/color_map.h"
#include "appearance/color_model.h"

namespace sdftrack {
namespace {

const Camera kDepth{{590, 585, 320, 240}, 640, 480, {}};

void expect_pixel(const appearance::ColorMap& map, Vec2d u, double depth, Vec2d expected) {
  int x = -1, y = -1;
  float z;
  ASSERT_TRUE(
      map.find({static_cast<float>(u.x), static_cast<float>(u.y)}, static_cast<float>(depth), &x, &y, &z));
  EXPECT_EQ(x, static_cast<int>(std::floor(expected.x + 0.5)));
  EXPECT_EQ(y, static_cast<int>(std::floor(expected.y + 0.5)));
}

TEST(ColorMap, the_pair_P_q_is_known_up_to_its_sign) {
  const Mat3d P{{1.44, 0.02, 60.9}, {-0.02, 1.46, 48.2}, {-3e-5, 5e-5, 1.64}};
  const Vec3d q{11.7, -8.8, -0.03};
  const Vec3d at = P * Vec3d{0.8 * 300, 0.8 * 200, 0.8} + q;
  for (const double sign : {1.0, -1.0})
    expect_pixel(appearance::projective_map(sign * P, sign * q, 640, 480), {300, 200}, 0.8,
                 {at.x / at.z, at.y / at.z});
}

TEST(ColorMap, a_pixel_outside_the_colour_image_is_not_found) {
  const appearance::ColorMap map = appearance::aligned_map(640, 480);
  int x, y;
  float z;
  EXPECT_TRUE(map.find({639, 479}, 1, &x, &y, &z));
  EXPECT_FALSE(map.find({640, 479}, 1, &x, &y, &z));
  EXPECT_FALSE(map.find({-1, 10}, 1, &x, &y, &z));
  const appearance::ColorMap behind = appearance::rigid_map(kDepth, kDepth, {Mat3d::identity(), {0, 0, -2}});
  EXPECT_FALSE(behind.find({320, 240}, 1, &x, &y, &z));
}

double sum(const std::vector<float>& v) { return std::accumulate(v.begin(), v.end(), 0.0); }

TEST(ColorModel, smoothing_keeps_the_sum_also_in_the_corners_of_the_cube) {
  for (const std::size_t bin : {0u, 4095u, 1234u}) {
    std::vector<float> share(appearance::kColorBins), scratch, out;
    share[bin] = 1;
    appearance::smooth_histogram(share, &scratch, &out);
    EXPECT_NEAR(sum(out), 1, 1e-6);
    EXPECT_LT(out[bin], 0.5);
  }
}

appearance::ColorCounts counts_of(int object_bin, int background_bin) {
  appearance::ColorCounts counts;
  for (int i = 0; i < 100; ++i) counts.add_object(object_bin), counts.add_background(background_bin);
  return counts;
}

TEST(ColorModel, too_few_pixels_of_the_object_make_no_model_and_later_change_none) {
  appearance::ColorCounts few;
  for (int i = 0; i < 10; ++i) few.add_object(5);
  appearance::ColorModel model;
  model.update(few, 1, 1);
  EXPECT_FALSE(model.known());
  model.update(counts_of(1000, 3000), 1, 1);
  const std::vector<float> before = model.posterior();
  model.update(few, 1, 1);
  EXPECT_EQ(model.posterior(), before);
}

}  // namespace
}  // namespace sdftrack
