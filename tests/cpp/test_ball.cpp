// SPDX-License-Identifier: MIT
// The ball of a registration in both images: exact geometry, edges, blobs.
#include <gtest/gtest.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include "base/normal.h"
#include "calibration/ball/blobs.h"
#include "calibration/ball/cone.h"
#include "calibration/ball/depth_ball.h"
#include "calibration/ball/edges.h"
#include "calibration/ball/median.h"

namespace sdftrack {
namespace {

using namespace calibration;

const Camera kPinhole{{525, 530, 300, 250}, 640, 480, {}};
const Camera kLens{{525, 530, 300, 250}, 640, 480, {0.12, -0.25, 0.001, -0.0005, 0.1}};

// Pixels of a sphere's outline, exact: its tangent rays stand on the circle of its tangent points.
std::vector<Vec2d> outline_of_sphere(const Camera& camera, Vec3d center, double radius_m, int count) {
  const double distance = norm(center);
  const Cone cone{(1 / distance) * center, std::asin(radius_m / distance), {}, {}};
  return outline_of(cone, camera, count).at;
}

TEST(Cone, the_axis_of_the_tangent_cone_is_the_image_of_the_centre) {
  for (const Camera& camera : {kPinhole, kLens})
    for (const Vec3d center : {Vec3d{0.3, -0.2, 0.7}, Vec3d{0, 0, 1}, Vec3d{-0.4, 0.25, 0.8}}) {
      const auto cone = fit_cone(unit_rays(outline_of_sphere(camera, center, 0.04, 360), camera), camera);
      ASSERT_TRUE(cone);
      const Vec2d requested = camera.project_point(center);
      EXPECT_NEAR(cone->center_px.x, requested.x, 1e-6);
      EXPECT_NEAR(cone->center_px.y, requested.y, 1e-6);
      EXPECT_NEAR(cone->half_angle_rad, std::asin(0.04 / norm(center)), 1e-8);
    }
}

TEST(Cone, the_stated_spread_of_a_centre_is_the_one_found) {
  const Vec3d center{0.2, 0.1, 0.8};
  const Vec2d requested = kPinhole.project_point(center);
  const std::vector<Vec2d> outline = outline_of_sphere(kPinhole, center, 0.04, 160);  // one edge a pixel
  std::mt19937_64 random(1);
  Normal normal;
  double chi2 = 0;
  for (int run = 0; run < 300; ++run) {
    std::vector<Vec2d> edges = outline;
    for (Vec2d& e : edges) e.x += 0.1 * normal(random), e.y += 0.1 * normal(random);
    const auto cone = fit_cone(unit_rays(edges, kPinhole), kPinhole);
    const Eigen::Vector2d off(cone->center_px.x - requested.x, cone->center_px.y - requested.y);
    chi2 += off.dot(cone->covariance_px.inverse() * off) / 300;
  }
  EXPECT_GT(chi2, 1.6);  // chi-square of two: 2; 300 runs and the robust scale leave 15 %
  EXPECT_LT(chi2, 2.6);
}

TEST(SphereHit, its_depth_changes_with_the_centre_as_differences_say) {
  constexpr double kStep = 1e-6;
  const Vec3d center{0.05, -0.03, 0.8};
  for (const Vec2d off : {Vec2d{0.02, 0.01}, Vec2d{-0.03, 0.02}, Vec2d{0, -0.025}}) {
    const Vec3d ray{center.x / center.z + off.x, center.y / center.z + off.y, 1};
    const SphereHit hit = hit_sphere(ray, center, 0.04);
    EXPECT_NEAR(norm(hit.z * ray - center), 0.04, 1e-12);
    const double analytic[] = {hit.by_center.x, hit.by_center.y, hit.by_center.z};
    for (int k = 0; k < 3; ++k) {
      const Vec3d e{k == 0 ? kStep : 0, k == 1 ? kStep : 0, k == 2 ? kStep : 0};
      const double ahead = hit_sphere(ray, center + e, 0.04).z, behind = hit_sphere(ray, center - e, 0.04).z;
      EXPECT_NEAR(analytic[k], (ahead - behind) / (2 * kStep), 1e-5);
    }
  }
  EXPECT_TRUE(std::isnan(hit_sphere({0.5, 0, 1}, center, 0.04).z));
}

// A row of an edge at x = 30.37, box-filtered, with a ball that gets darker towards its rim.
class EdgeOfShade : public testing::TestWithParam<double> {};
TEST_P(EdgeOfShade, is_found_to_a_few_hundredths) {
  constexpr int kWidth = 60, kHeight = 40, kFine = 20;
  constexpr double kAt = 30.37;
  std::vector<Rgb> pixels(kWidth * kHeight);
  for (int x = 0; x < kWidth; ++x) {
    Vec3d sum{0, 0, 0};
    for (int k = 0; k < kFine; ++k) {
      const double u = x + (k + 0.5) / kFine - 0.5;
      const double light = 1 - GetParam() * std::clamp((u - 15) / 20, 0.0, 1.0);
      sum = sum + (1.0 / kFine) * (u < kAt ? light * Vec3d{210, 50, 30} : Vec3d{140, 145, 150});
    }
    const auto byte = [](double c) { return static_cast<std::uint8_t>(std::lround(c)); };
    for (int y = 0; y < kHeight; ++y)
      pixels[static_cast<std::size_t>(y * kWidth + x)] = {byte(sum.x), byte(sum.y), byte(sum.z)};
  }
  const RgbImage image{pixels.data(), kWidth, kHeight};
  for (double y = 10; y < 30; y += 1.05) {
    const Edge edge = edge_along(image, {30, y}, {1, 0}, 3);
    EXPECT_TRUE(edge.sure);
    EXPECT_NEAR(edge.at.x, kAt, 0.03);  // 8 bits, linear interpolation
  }
  EXPECT_FALSE(edge_along(image, {50, 20}, {1, 0}, 3).sure);
}
INSTANTIATE_TEST_SUITE_P(Shades, EdgeOfShade, testing::Values(0.0, 0.5));

TEST(Blobs, the_border_is_the_outer_one_and_specks_are_opened_away) {
  frame::PixelMask mask(20, 12);
  for (std::size_t y = 2; y < 9; ++y)
    for (std::size_t x = 3; x < 10; ++x) mask.on[20 * y + x] = 1;
  mask.on[20 * 5 + 6] = 0;   // a hole
  mask.on[20 * 9 + 10] = 1;  // hangs on by a corner
  mask.on[20 * 4 + 15] = 1;  // a speck
  const std::vector<Blob> blobs = largest_blobs(mask, 3, 1);
  ASSERT_EQ(blobs.size(), 2U);
  EXPECT_EQ(blobs[0].area, 49);
  EXPECT_EQ(blobs[0].border.size(), 25U);  // 24 around the square, and the corner
  EXPECT_EQ(blobs[1].area, 1);
  EXPECT_EQ(largest_blobs(dilated(eroded(mask, 1), 1), 3, 1).size(), 1U);
}

TEST(Median5, is_that_of_each_window_also_at_the_edges) {
  std::mt19937_64 random(3);
  std::vector<float> values(37 * 9);
  for (float& v : values) v = static_cast<float>(random() % 100) / 10;
  const ImageView<float> image{values.data(), 37, 9};
  const std::vector<float> found = median5(image);
  for (int y = 0; y < 9; ++y)
    for (int x = 0; x < 37; ++x) {
      std::vector<double> window;
      for (int k = 0; k < 25; ++k)
        window.push_back(image(std::clamp(x + k % 5 - 2, 0, 36), std::clamp(y + k / 5 - 2, 0, 8)));
      EXPECT_EQ(found[static_cast<std::size_t>(37 * y + x)], static_cast<float>(median_of(&window)));
    }
}

}  // namespace
}  // namespace sdftrack
