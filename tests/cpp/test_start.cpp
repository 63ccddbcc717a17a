// SPDX-License-Identifier: MIT
// Sets of pixels and shares of values, against loops over all of them; regions of a start.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "base/quantile.h"
#include "frame/image/pixel_mask.h"
#include "frame/image/point_image.h"
#include "plane/near_planes.h"
#include "tracking/start/click_regions.h"
#include "tracking/start/standing_regions.h"

namespace sdftrack::frame {
namespace {

PixelMask speckled(int width, int height, unsigned seed) {
  PixelMask out(width, height);
  for (unsigned char& on : out.on) seed = seed * 1664525u + 1013904223u, on = (seed >> 24) < 40;
  return out;
}

bool any_within(const PixelMask& mask, int x, int y, int by, bool value) {
  for (int v = std::max(0, y - by); v <= std::min(mask.height - 1, y + by); ++v)
    for (int u = std::max(0, x - by); u <= std::min(mask.width - 1, x + by); ++u)
      if (mask(u, v) == value) return true;
  return false;
}

TEST(PixelMask, grows_and_shrinks_by_squares) {
  for (const int by : {1, 2, 4}) {
    const PixelMask mask = speckled(37, 23, 7), grown = dilated(mask, by), shrunk = eroded(grown, by);
    for (int y = 0; y < mask.height; ++y)
      for (int x = 0; x < mask.width; ++x) {
        EXPECT_EQ(grown(x, y), any_within(mask, x, y, by, true));
        EXPECT_EQ(shrunk(x, y), !any_within(grown, x, y, by, false));
      }
    EXPECT_EQ(closed(mask, by), shrunk);
  }
}

TEST(PixelMask, pieces_are_connected_and_touch_no_other) {
  const PixelMask mask = speckled(41, 29, 3);
  for (const bool corners : {false, true}) {
    const Pieces pieces = pieces_of(mask, corners ? Neighborhood::kSidesAndCorners : Neighborhood::kSides);
    int sum = 0, last = 0;
    for (const int area : pieces.areas) sum += area;
    EXPECT_EQ(sum, count(mask));
    for (int y = 0; y < mask.height; ++y)
      for (int x = 0; x < mask.width; ++x) {
        const int number = pieces.number[mask.at(x, y)];
        EXPECT_EQ(number > 0, mask(x, y));
        EXPECT_LE(number, last + 1);  // in the order of their first pixels
        last = std::max(last, number);
        const auto same = [&](int u, int v) {
          if (u < 0 || u >= mask.width || v >= mask.height || !mask(x, y) || !mask(u, v)) return;
          EXPECT_EQ(pieces.number[mask.at(u, v)], number);
        };
        same(x + 1, y), same(x, y + 1);
        if (corners) same(x + 1, y + 1), same(x - 1, y + 1);
      }
    for (int k = 1; k < static_cast<int>(pieces.areas.size()); ++k)
      EXPECT_EQ(count(pieces.piece(k, mask)), pieces.areas[static_cast<std::size_t>(k)]);
  }
}

TEST(PointImage, a_quantile_lies_between_two_values) {
  std::vector<double> values;
  for (int i = 0; i < 50; ++i) values.push_back(std::fmod(17.3 * i, 5.0));
  std::vector<double> sorted = values;
  std::sort(sorted.begin(), sorted.end());
  for (const double share : {0.0, 0.05, 0.5, 0.73, 1.0}) {
    const double at = share * 49;
    const auto below = static_cast<std::size_t>(at), above = std::min<std::size_t>(49, below + 1);
    const double expected = sorted[below] + (at - std::floor(at)) * (sorted[above] - sorted[below]);
    EXPECT_DOUBLE_EQ(quantile(&values, share), expected);
  }
}

TEST(PointImage, a_few_points_far_behind_do_not_shorten_the_extent) {
  std::vector<Vec3d> points;
  for (int i = 0; i < 400; ++i) points.push_back({0.0004 * i, 0.0002 * (i % 50), 0.7});
  for (int i = 0; i < 20; ++i) points.push_back({0.08, 0.005, 2.0});
  EXPECT_GT(longest_extent_m(points, 0.05, 0.95), 0.13);
}

// Grows by the neighbours of all pixels until nothing changes.
PixelMask joined_slowly(const ImageView<float>& depth, const PixelMask& free, Pixel seed, float step_m) {
  PixelMask on(free.width, free.height), before;
  on.on[on.at(seed.x, seed.y)] = free(seed.x, seed.y);
  while (!(on == before)) {
    before = on;
    for (int y = 0; y < free.height; ++y)
      for (int x = 0; x < free.width; ++x)
        for (int v = std::max(0, y - 1); v <= std::min(free.height - 1, y + 1); ++v)
          for (int u = std::max(0, x - 1); u <= std::min(free.width - 1, x + 1); ++u)
            if (before(u, v) && free(x, y) && std::abs(depth(x, y) - depth(u, v)) <= step_m)
              on.on[on.at(x, y)] = 1;
  }
  return on;
}

TEST(Joined, is_what_steps_from_neighbour_to_neighbour_reach) {
  for (unsigned seed = 0; seed < 8; ++seed) {
    const int width = 45, height = 35;
    std::mt19937 random(seed);
    std::uniform_real_distribution<float> share(0, 1);
    std::vector<float> depth;
    PixelMask free(width, height);
    for (int i = 0; i < width * height; ++i) {
      const int x = i % width, y = i / width;
      depth.push_back(0.8f + 0.2f * std::sin(0.3f * float(x)) * std::cos(0.2f * float(y)) +
                      0.04f * share(random) + (x > 25 ? 0.3f : 0.0f));
      free.on[std::size_t(i)] = share(random) < 0.85f;
    }
    const ImageView<float> view{depth.data(), width, height};
    free.on[free.at(10, 17)] = 1, free.on[free.at(11, 17)] = 0;
    const PixelMask found = joined(view, free, {10, 17}, 0.06f, Neighborhood::kSidesAndCorners);
    EXPECT_EQ(found, joined_slowly(view, free, {10, 17}, 0.06f));
    EXPECT_GT(count(found), 30);
    EXPECT_LT(count(found), 0.9 * count(free));
    EXPECT_EQ(count(joined(view, free, {11, 17}, 0.06f, Neighborhood::kSidesAndCorners)), 0);  // not free
  }
}

// -- Regions of a start
const Camera kCamera{{150, 150, 79.5, 59.5}, 160, 120, {}};

struct View {
  std::vector<float> depth;
  std::vector<unsigned char> rgb;
  appearance::ColorImage image;

  // Depth (m) by pixel, with noise of 1 mm; 0: none.
  template <class Depth>
  explicit View(const Depth& at) {
    std::mt19937 random(1);
    std::normal_distribution<float> noise(0, 0.001f);
    for (int y = 0; y < 120; ++y)
      for (int x = 0; x < 160; ++x) {
        const double z = at(x, y);
        depth.push_back(z > 0 ? float(z) + noise(random) : 0);
      }
  }
  DepthFrame frame() {
    DepthFrame out{{depth.data(), 160, 120}, nullptr, nullptr};
    if (!rgb.empty()) image = {rgb.data(), appearance::aligned_map(160, 120)}, out.color = &image;
    return out;
  }
  std::vector<plane::NearPlane> planes(double size_m) {
    const PointImage points = points_of(frame(), kCamera, {0, 0, 160, 120});
    return plane::planes_near(points, points.measured(), size_m);
  }
};

double iou(const PixelMask& a, const PixelMask& b) {
  int both = 0, either = 0;
  for (std::size_t i = 0; i < a.on.size(); ++i) both += a.on[i] && b.on[i], either += a.on[i] || b.on[i];
  return double(both) / either;
}
double best_iou(const std::vector<PixelMask>& regions, const PixelMask& mask) {
  double best = 0;
  for (const PixelMask& one : regions) best = std::max(best, iou(one, mask));
  return best;
}
PixelMask rectangle(int x0, int y0, int x1, int y1) {
  PixelMask out(160, 120);
  for (int y = y0; y < y1; ++y)
    for (int x = x0; x < x1; ++x) out.on[out.at(x, y)] = 1;
  return out;
}

TEST(NearPlanes, a_slice_through_a_round_thing_is_none) {
  // Of a ball of 12 cm radius a slab as thick as a plane's tolerance holds a cap of 10 cm.
  for (const bool flat : {true, false}) {
    View view([&](int x, int y) {
      const Vec3d r = ray(kCamera.K, double(x), double(y));
      const double b = 0.62 * r.z, root = b * b - dot(r, r) * (0.62 * 0.62 - 0.12 * 0.12);
      return root < 0 ? 0 : flat ? 0.5 : (b - std::sqrt(root)) / dot(r, r);
    });
    EXPECT_EQ(view.planes(0.05).size(), flat);
  }
}

// A table that the camera looks down on: n . p + kTable_m = 0; a board stands up from it, across the view.
const Vec3d kUp{0, -std::cos(0.6), -std::sin(0.6)};
constexpr double kTable_m = 0.75 * 0.5646424733950354;  // sin 0.6

View table_with_board() {
  return View([](int x, int y) {
    if (x >= 60 && x < 90 && y >= 40 && y < 75) return 0.6;
    const double along = dot(kUp, ray(kCamera.K, double(x), double(y)));
    return along < -0.1 ? -kTable_m / along : 0.0;
  });
}

TEST(NearPlanes, the_largest_is_the_table) {
  const std::vector<plane::NearPlane> found = table_with_board().planes(0.2);
  ASSERT_GE(found.size(), 1u);
  EXPECT_GT(dot(found[0].plane.normal_cam, kUp), std::cos(0.5 * 3.14159 / 180));
  EXPECT_NEAR(found[0].plane.offset_m, kTable_m, 0.003);
  EXPECT_LT(iou(found[0].pixels, rectangle(60, 40, 90, 75)), 0.1);
}

TEST(StandingRegions, what_holes_have_parted_is_one_region_too) {
  const PixelMask board = rectangle(60, 40, 90, 75);
  View view = table_with_board();
  EXPECT_GT(best_iou(tracking::standing_regions(view.frame(), kCamera, 0.2).regions, board), 0.8);
  for (int y = 57; y < 59; ++y) std::fill_n(&view.depth[std::size_t(y) * 160 + 60], 30, 0.0f);
  EXPECT_GT(best_iou(tracking::standing_regions(view.frame(), kCamera, 0.2).regions, board), 0.8);
}

TEST(ClickRegions, the_first_hangs_together_without_planes) {
  View view = table_with_board();
  for (const Vec2d px : {Vec2d{70, 50}, {85, 70}})
    EXPECT_GT(iou(tracking::click_regions(view.frame(), kCamera, px, 0.2)[0], rectangle(60, 40, 90, 75)),
              0.9);
}

// Two boxes of one colour each stand side by side on one level: only their colours part them.
TEST(ClickRegions, colours_part_what_touches_in_depth_if_they_are_seen_elsewhere_too) {
  View view([](int x, int y) { return x >= 40 && x < 120 && y >= 40 && y < 80 ? 0.8 : 1.5; });
  const PixelMask left = rectangle(40, 40, 80, 80);
  EXPECT_LT(best_iou(tracking::click_regions(view.frame(), kCamera, {55, 60}, 0.5), left), 0.6);
  std::mt19937 random(3);
  std::normal_distribution<double> noise(0, 6);
  for (int i = 0; i < 160 * 120; ++i) {
    constexpr int kColors[3][3] = {{120, 120, 120}, {200, 40, 30}, {40, 60, 190}};
    const int x = i % 160, y = i / 160;
    const bool on = x >= 40 && x < 120 && y >= 40 && y < 80;  // and more of the second colour behind
    for (const int c : kColors[x >= 125 ? 2 : !on ? 0 : x < 80 ? 1 : 2])
      view.rgb.push_back(static_cast<unsigned char>(std::clamp(c + noise(random), 0.0, 255.0)));
  }
  EXPECT_GT(best_iou(tracking::click_regions(view.frame(), kCamera, {55, 60}, 0.5), left), 0.9);
}

TEST(NearestReading, among_holes_is_the_surface_and_not_an_island_of_it_nor_what_is_behind) {
  std::vector<float> depth(40 * 40, 0.7f);
  for (int y = 15; y < 26; ++y) std::fill_n(&depth[std::size_t(y) * 40 + 19], 7, 0.0f);
  depth[20 * 40 + 21] = 0.71f;  // an island one pixel from the click
  const DepthFrame frame{{depth.data(), 40, 40}, nullptr, nullptr};
  const Pixel near = tracking::nearest_reading(frame, {20, 20});
  EXPECT_EQ(near.x, 18);
  EXPECT_EQ(near.y, 20);
  std::replace(depth.begin(), depth.end(), 0.7f, 1.5f);  // a wall behind a thin thing
  EXPECT_EQ(tracking::nearest_reading(frame, {20, 20}).x, 21);
}

}  // namespace
}  // namespace sdftrack::frame
