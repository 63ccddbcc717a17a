// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tracking/trust/outline.h"
#include "tracking/trust/silhouette_colors.h"
#include "volume_fixture.h"

namespace sdftrack {
namespace {

constexpr double kRadius_m = 0.05, kBall_m = 0.6, kWall_m = 1.0;
constexpr double kNoise_m = 0.001;

// A ball before a wall, seen by a small camera.
struct Scene {
  Volume ball = make_volume(71, 0.07, [](Vec3d p) { return norm(p) - kRadius_m; });
  std::vector<float> depth;
  Camera camera{{200, 200, 79.5, 59.5}, 160, 120, {}};
  frame::Shape shape;
  Rigidd T{Mat3d::identity(), {0.01, -0.02, kBall_m}};

  Scene() : depth(160 * 120, static_cast<float>(kWall_m)) {
    shape = frame::make_shape(ball.view(), 480, 120);
    each_pixel([&](Vec3d r) {
      const double b = dot(r, T.t), c = dot(T.t, T.t) - kRadius_m * kRadius_m;
      const double d = b * b - dot(r, r) * c;
      return d > 0 ? (b - std::sqrt(d)) / dot(r, r) : kWall_m;
    });
  }

  template <class Depth>
  void each_pixel(const Depth& at) {
    for (int y = 0; y < camera.height; ++y)
      for (int x = 0; x < camera.width; ++x)
        depth[static_cast<std::size_t>(y * camera.width + x)] =
            static_cast<float>(at(ray(camera.K, static_cast<double>(x), static_cast<double>(y))));
  }
  tracking::Outline outline() const {
    return tracking::compare_outline({{depth.data(), camera.width, camera.height}, nullptr, nullptr}, camera,
                                     shape, T, tracking::DepthError{kNoise_m});
  }
};

TEST(Outline, a_free_body_ends_all_around) {
  const tracking::Outline o = Scene().outline();
  EXPECT_EQ(o.ends, 24);
  EXPECT_EQ(o.runs_on + o.unknown, 0);
}

TEST(Outline, a_body_let_into_a_wall_runs_on_all_around) {
  Scene scene;
  const double rim_m = kBall_m - kRadius_m * kRadius_m / kBall_m;  // depth of the ball's silhouette
  for (float& z : scene.depth) z = std::min(z, static_cast<float>(rim_m));
  const tracking::Outline o = scene.outline();
  EXPECT_EQ(o.runs_on, 24);
}

TEST(Outline, what_is_hidden_or_not_read_says_nothing) {
  Scene scene;
  for (int y = 0; y < 120; ++y)
    for (int x = 0; x < 80; ++x) scene.depth[static_cast<std::size_t>(y * 160 + x)] = x % 2 ? 0.3f : 0.0f;
  const tracking::Outline o = scene.outline();
  EXPECT_GE(o.unknown, 10);
  EXPECT_EQ(o.unknown + o.ends, 24);
}

// A red ball, a hand that covers its right half, a blue wall.
TEST(SilhouetteColors, what_depth_shows_in_front_is_not_the_objects) {
  Scene scene;
  constexpr unsigned char kBall[] = {200, 40, 40}, kHand[] = {90, 160, 60}, kWall[] = {40, 60, 180};
  std::vector<unsigned char> rgb;
  for (std::size_t i = 0; i < scene.depth.size(); ++i) {
    const bool on_ball = static_cast<double>(scene.depth[i])<kWall_m, right = i % 160> 82;
    const unsigned char* const c = on_ball ? (right ? kHand : kBall) : kWall;
    if (on_ball && right) scene.depth[i] -= 0.015f;
    rgb.insert(rgb.end(), c, c + 3);
  }
  const appearance::ColorImage image{rgb.data(), appearance::aligned_map(160, 120)};
  const auto hand = static_cast<std::size_t>(appearance::color_bin(kHand)),
             ball = static_cast<std::size_t>(appearance::color_bin(kBall));
  for (const bool with_depth : {true, false}) {
    frame::DepthFrame frame{{with_depth ? scene.depth.data() : nullptr, 160, 120}, nullptr, nullptr};
    frame.color = &image;
    appearance::ColorCounts counts;
    tracking::count_silhouette_colors(frame, scene.camera, scene.shape, scene.T, 40, 20000,
                                      appearance::ColorModel(), &counts);
    EXPECT_GT(counts.object[ball], 100);
    EXPECT_GT(counts.background_pixels, 100);
    if (with_depth)
      EXPECT_EQ(counts.object[hand], 0);
    else
      EXPECT_GT(counts.object[hand], 100);
  }
}

}  // namespace
}  // namespace sdftrack
