// SPDX-License-Identifier: MIT
// The memory of silhouettes: pictures resampled, places, pieces, and the search for a shape that is known.
#include <gtest/gtest.h>

#include <cmath>

#include "contour/memory/mask_ops.h"
#include "contour/memory/occluders.h"
#include "contour/memory/placement.h"
#include "contour/memory/resampling.h"
#include "contour/memory/silhouette_memory.h"
#include "contour/memory/silhouette_search.h"

namespace sdftrack::contour {
namespace {

template <class Inside>
Mask mask_where(int width, int height, const Inside& inside) {
  Mask out(width, height);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) out.row(y)[x] = inside(x, y);
  return out;
}

double overlap(const Mask& a, const Mask& b) {
  return static_cast<double>(area_of(both(a, b))) / area_of(union_of(a, b));
}

// A body with an arm that points somewhere, in the memory's frame.
Mask figure(double angle) {
  return mask_where(kFrame, kFrame, [angle](int x, int y) {
    const double u = x - 31.5, v = y - 31.5, along = u * std::cos(angle) + v * std::sin(angle);
    const double across = v * std::cos(angle) - u * std::sin(angle);
    return std::hypot(u, v) < 9 || (along > 0 && along < 22 && std::abs(across) < 3);
  });
}

TEST(Resampling, a_plane_stays_a_plane) {
  Picture plane(24, 18);
  for (int y = 0; y < 18; ++y)
    for (int x = 0; x < 24; ++x) plane.row(y)[x] = 1 + 0.5f * static_cast<float>(x) - static_cast<float>(y);
  const GridWarp warp{{0.8, -0.2, 0.1, 0.9}, {5.25, 3.5}};
  const Picture moved = warped(plane, warp, 10, 10);
  for (int y = 0; y < 10; ++y)
    for (int x = 0; x < 10; ++x) {
      double u, v;
      warp.to_image(x, y, &u, &v);
      EXPECT_NEAR(moved.row(y)[x], 1 + 0.5 * u - v, 1e-5);
    }
  EXPECT_EQ(warped(plane, {{1, 0, 0, 1}, {-40, 0}}, 4, 4), Picture(4, 4));  // beyond is 0
  EXPECT_FLOAT_EQ(block_means(plane, 3).row(1)[2], plane.row(4)[7]);
  EXPECT_FLOAT_EQ(box_mean(plane, 2).row(9)[9], plane.row(9)[9]);
  EXPECT_NEAR(blurred(plane, 1, Border::kRepeated).row(9)[9], plane.row(9)[9], 1e-5f);
  EXPECT_NEAR(resized(plane, 10, 18).row(4)[4], 1 + 0.5f * (0.4f * 9 + 10 + 11) / 2.4f - 4,
              1e-5f);  // by area
  EXPECT_NEAR(resized(plane, 48, 36).row(9)[9], 1 + 0.5f * 4.25f - 4.25f, 1e-5f);
}

TEST(MaskOps, distances_and_slivers_of_a_half_plane_with_a_hair) {
  const Mask mask = mask_where(30, 30, [](int x, int y) { return x < 10 || (y == 15 && x < 20); });
  const Picture phi = signed_distances(mask, 4);
  EXPECT_FLOAT_EQ(phi.row(3)[9], -0.5f);
  EXPECT_FLOAT_EQ(phi.row(3)[11], 1.5f);
  EXPECT_FLOAT_EQ(phi.row(3)[2], -4);
  EXPECT_NEAR(phi.row(13)[11], std::sqrt(4.0f) - 0.5f, 1e-6f);
  const Mask thick = thick_parts(mask, 1);
  EXPECT_TRUE(thick.row(3)[9] && !thick.row(15)[15]);
  EXPECT_EQ(area_of(edge_of(mask_where(9, 9, [](int x, int y) { return x > 1 && x < 7 && y > 1 && y < 7; }))),
            16);
}

TEST(Occluders, slats_are_counted_but_not_the_legs_behind_one_bar) {
  const auto in = [](int x, int first, int width) { return x >= first && x < first + width; };
  const auto slat = [&](int x) { return x % 12 < 5 && in(x, 12, 48); };
  const Mask body = mask_where(64, 64, [&](int x, int y) { return in(y, 10, 20) && in(x, 8, 52); });
  const Mask slats = mask_where(64, 64, [&](int x, int y) { return in(y, 10, 20) && slat(x); });
  EXPECT_EQ(count_occluders(slats, without(body, slats)), 4);
  const Mask legs = mask_where(64, 64, [&](int x, int y) { return in(y, 30, 30) && slat(x + 2); });
  const Mask bar = mask_where(64, 64, [&](int, int y) { return in(y, 40, 8); });
  EXPECT_EQ(count_occluders(both(legs, bar), without(union_of(body, legs), bar)), 1);
  EXPECT_EQ(count_occluders(Mask(64, 64), body), 0);
}

TEST(Placement, a_mask_comes_back_from_the_frame_of_its_placement) {
  const Mask mask =
      mask_where(110, 90, [](int x, int y) { return std::hypot((x - 50) / 20.0, (y - 40) / 12.0) < 1; });
  const GridWarp warp{{1.2, -0.9, 0.9, 1.2}, {33, -7}};
  const Placement place = placement_of(mask, warp);
  EXPECT_NEAR(place.center_px[0], 1.2 * 50 - 0.9 * 40 + 33, 1e-9);
  EXPECT_NEAR(place.center_px[1], 0.9 * 50 + 1.2 * 40 - 7, 1e-9);
  EXPECT_NEAR(place.size_px, 1.5 * std::sqrt(area_of(mask)), 1e-9);
  const Mask seen = seen_from(mask, warp, place, kFrame);
  EXPECT_NEAR(std::sqrt(area_of(seen)), kFill * kFrame, 0.03 * kFill * kFrame);
  EXPECT_GT(overlap(put_back(seen, warp, place, 110, 90), mask), 0.95);  // two resamplings
}

TEST(MotionPredictor, a_steady_path_goes_straight_on_and_a_jump_does_not_change_the_size) {
  MotionPredictor motion;
  for (int t = 0; t < 20; ++t) motion.add(t, {{10.0 + 2 * t, 50.0 - t}, 30});
  const Prediction there = motion.predict(20);
  EXPECT_NEAR(there.center_px[0], 50, 1);  // what the damping of the velocity keeps back
  EXPECT_NEAR(there.center_px[1], 30, 1);
  EXPECT_NEAR(there.size_px, 30, 1e-9);
  motion.add(20, {{80, 30}, 10}, 0.02);  // next to everything is hidden
  EXPECT_NEAR(motion.predict(21).size_px, 30, 1.5);
  EXPECT_EQ(motion.predict(21).place_error, there.place_error);  // what is not sure says nothing of it
}

TEST(SilhouetteSearch, a_known_silhouette_is_found_where_it_lies_though_a_part_is_hidden) {
  SilhouetteMemory memory({});
  for (int k = 0; k < 24; ++k) memory.learn(figure(k * 0.25));
  const Prediction predicted{{80, 60}, 30, 0.2, 0.1};  // often far off
  const GridWarp warp{{1, 0, 0, 1}, {30, 10}};
  const Placement start{predicted.center_px, predicted.size_px};
  for (const int hidden : {0, 6}) {
    const Placement there = start.moved({4, -3, 0.05, 0.02}, kFrame);
    const Mask whole = put_back(figure(1.25), warp, there, 110, 110);
    Picture odds = each<float>(whole, [](unsigned char inside) { return inside ? 1.0f : -1.0f; });
    for (int y = 0; y < 110; ++y)
      for (int x = 50; x < 50 + hidden; ++x) odds.row(y)[x] = 0;  // colours of neither side
    const Found found = find_silhouette(odds, warp, predicted, start.turn, memory.library(),
                                        memory.library().dissimilarity(figure(1.0)));
    EXPECT_NEAR(found.placement.center_px[0], there.center_px[0], 2);
    EXPECT_NEAR(found.placement.center_px[1], there.center_px[1], 2);
    EXPECT_NEAR(found.placement.size_px, there.size_px, 0.04 * there.size_px);
    EXPECT_GT(overlap(put_back(inside_of(found.expected.phi), warp, found.placement, 110, 110), whole), 0.8);
  }
}

}  // namespace
}  // namespace sdftrack::contour
