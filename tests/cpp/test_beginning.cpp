// SPDX-License-Identifier: MIT
// The object in a first frame: boxes, planes and noise.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "base/quantile.h"
#include "reconstruction/beginning.h"

namespace sdftrack {
namespace {

using frame::PixelMask;

TEST(Beginning, quantiles_lie_between_neighbours) {
  std::vector<double> values{4, 1, 3, 2};
  EXPECT_EQ(median(&values), 2.5);
  EXPECT_EQ(quantile(&values, 0.5), 2.5);
  EXPECT_EQ(quantile(&values, 0.25), 1.75);
  EXPECT_EQ(quantile(&values, 1), 4);
}

TEST(Beginning, the_shorter_side_of_a_turned_rectangle_is_found) {
  for (const double angle : {0.0, 0.3, 1.2}) {
    PixelMask mask(200, 200);
    for (int y = 0; y < 200; ++y)
      for (int x = 0; x < 200; ++x) {
        const double u = std::cos(angle) * (x - 100) + std::sin(angle) * (y - 100),
                     v = std::cos(angle) * (y - 100) - std::sin(angle) * (x - 100);
        mask.on[mask.at(x, y)] = std::abs(u) <= 60 && std::abs(v) <= 25;
      }
    EXPECT_NEAR(reconstruction::shorter_side_px(mask), 50, 1.5) << angle;
  }
  EXPECT_EQ(reconstruction::shorter_side_px(PixelMask(5, 5)), 0);
}

// A board before a wall; the board is slanted.
std::vector<float> board(int width, int height) {
  std::vector<float> depth;
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x)
      depth.push_back(x > 20 && x < 60 && y > 15 && y < 45 ? 0.5f + 0.001f * static_cast<float>(x) : 0.62f);
  return depth;
}

TEST(Beginning, a_box_takes_the_surface_at_its_centre_and_nothing_behind_it) {
  const std::vector<float> depth = board(80, 60);
  const PixelMask mask = reconstruction::mask_of_box({depth.data(), 80, 60}, {10, 10, 70, 50});
  for (int y = 0; y < 60; ++y)
    for (int x = 0; x < 80; ++x) EXPECT_EQ(mask(x, y), x > 20 && x < 60 && y > 15 && y < 45);
}

TEST(Beginning, the_noise_of_a_slanted_surface_is_measured) {
  std::vector<float> depth = board(80, 60);
  PixelMask mask(80, 60);
  for (std::size_t i = 0; i < depth.size(); ++i) mask.on[i] = depth[i] < 0.58f;
  std::mt19937 random(2);
  std::normal_distribution<float> noise(0, 0.003f);
  for (float& z : depth) z += noise(random);
  EXPECT_NEAR(reconstruction::measured_noise_m({{depth.data(), 80, 60}, nullptr, nullptr}, mask), 0.003,
              0.0003);
}

TEST(Beginning, what_was_filled_in_a_lattice_of_holes_does_not_make_the_noise_smaller) {
  std::mt19937 random(2);
  std::normal_distribution<float> noise(0, 0.003f);
  PixelMask mask(80, 60);
  std::vector<float> given(80 * 60), filled(80 * 60, 0.6f);  // without noise
  for (int y = 0; y < 60; ++y)
    for (int x = 0; x < 80; ++x) {
      const std::size_t i = mask.at(x, y);
      mask.on[i] = 1;
      if (y % 3 && x % 3) given[i] = filled[i] += noise(random);
    }
  frame::DepthFrame frame{{filled.data(), 80, 60}, nullptr, nullptr};
  frame.given_m = given.data();
  EXPECT_NEAR(reconstruction::measured_noise_m(frame, mask), 0.003, 0.0003);
}

TEST(Beginning, the_wall_behind_an_object_bounds_it_and_the_object_is_no_plane) {
  const std::vector<float> depth = board(80, 60);
  const Camera camera{{100, 100, 39.5, 29.5}, 80, 60, {}};
  tracking::PoseHint place;
  for (const float z : depth) place.mask.push_back(z < 0.58f);
  const reconstruction::Beginning found =
      reconstruction::find_object({{depth.data(), 80, 60}, nullptr, nullptr}, place, camera, nullptr, {});
  ASSERT_TRUE(found.view);
  ASSERT_EQ(found.view->planes.size(), 1u);
  EXPECT_NEAR(found.view->planes[0].normal_cam.z, -1, 1e-9);
  EXPECT_NEAR(found.view->planes[0].offset_m, 0.62, 1e-6);
  EXPECT_EQ(found.on_object.on, place.mask);
  EXPECT_NEAR(found.ball.radius_m, 0.5 * 0.38 * 0.54, 0.005);
}

}  // namespace
}  // namespace sdftrack
