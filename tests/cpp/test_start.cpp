// SPDX-License-Identifier: MIT
// Sets of pixels and shares of values, against loops over all of them.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "base/quantile.h"
#include "frame/image/pixel_mask.h"
#include "frame/image/point_image.h"

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

}  // namespace
}  // namespace sdftrack::frame
