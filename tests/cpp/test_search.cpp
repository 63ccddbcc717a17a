// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <cmath>

#include "tracking/search/search.h"
#include "tracking/search/search_score.h"
#include "tracking/search/so3_grid.h"
#include "volume_fixture.h"

namespace sdftrack {
namespace {

TEST(So3Grid, the_order_starts_again_after_the_last) {
  const Mat3d a = tracking::seed_rotation(3, 240), b = tracking::seed_rotation(243, 240);
  EXPECT_LT(rotation_angle(transpose(a) * b), 1e-9);
}

TEST(SearchScore, what_the_sensor_sees_past_lowers_it_and_what_hides_hardly_does) {
  const tracking::Outline ends{24, 0, 0};
  const double gap_m = 0.001, right = tracking::score_of_place({100, 98, 0, 2, 0, gap_m}, ends);
  EXPECT_GT(right, 0.9);
  EXPECT_GT(tracking::score_of_place({100, 50, 0, 50, 0, gap_m}, ends), 0.75 * right);
  EXPECT_LT(tracking::score_of_place({100, 50, 50, 0, 0, gap_m}, ends), 0.1 * right);
  EXPECT_LT(tracking::score_of_place({100, 98, 0, 2, 0, 5 * gap_m}, ends), right);
}

TEST(SearchScore, a_face_in_a_wall_is_no_object) {
  const tracking::Visibility seen{100, 100, 0, 0, 0, 0.001};
  EXPECT_LT(tracking::score_of_place(seen, tracking::Outline{0, 24, 0}),
            tracking::score_of_place(seen, tracking::Outline{24, 0, 0}));
  EXPECT_TRUE(tracking::is_part_of_something(tracking::Outline{0, 24, 0}));
  EXPECT_FALSE(tracking::is_part_of_something(tracking::Outline{0, 3, 21}));  // too little to tell
}

TEST(SearchScore, a_mask_must_be_explained) {
  EXPECT_DOUBLE_EQ(tracking::score_of_mask({100, 80, 20, 0, 0}, 0.5), 0.4);
  EXPECT_EQ(tracking::score_of_mask({100, 5, 0, 95, 0}, 1.0), 0);
}

}  // namespace
}  // namespace sdftrack
