// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <climits>
#include <cmath>
#include <limits>

#include "base/to_int.h"

namespace sdftrack {
namespace {

template <class T>
class ToInt : public testing::Test {};
using Numbers = testing::Types<float, double>;
TYPED_TEST_SUITE(ToInt, Numbers);

TYPED_TEST(ToInt, what_an_int_holds_loses_its_fraction) {
  for (const int i : {-1000, -1, 0, 1, 7, 1 << 20}) {
    EXPECT_EQ(to_int(static_cast<TypeParam>(i)), i);
    EXPECT_EQ(to_int(static_cast<TypeParam>(i) + static_cast<TypeParam>(i < 0 ? -0.5 : 0.5)), i);
  }
}

TYPED_TEST(ToInt, what_no_int_holds_is_the_one_at_that_end) {
  constexpr TypeParam kInfinite = std::numeric_limits<TypeParam>::infinity();
  for (const TypeParam x : {static_cast<TypeParam>(2147483648.0), static_cast<TypeParam>(1e30), kInfinite}) {
    EXPECT_EQ(to_int(x), INT_MAX);
    EXPECT_EQ(to_int(-x), INT_MIN);
  }
  EXPECT_EQ(to_int(std::numeric_limits<TypeParam>::quiet_NaN()), 0);
}

TYPED_TEST(ToInt, bounds_hold_for_every_number) {
  constexpr TypeParam kNone = std::numeric_limits<TypeParam>::quiet_NaN();
  EXPECT_EQ(to_int_within(TypeParam(3.9), 2, 5), 3);
  EXPECT_EQ(to_int_within(TypeParam(-1e30), 2, 5), 2);
  EXPECT_EQ(to_int_within(TypeParam(1e30), 2, 5), 5);
  EXPECT_EQ(to_int_within(kNone, 2, 5), 2);
}

TEST(ToIntOf, the_ends_of_the_ints_are_reached) {
  EXPECT_EQ(to_int(2147483647.0), INT_MAX);
  EXPECT_EQ(to_int(2147483646.9), INT_MAX - 1);
  EXPECT_EQ(to_int(-2147483648.0), INT_MIN);
  EXPECT_EQ(to_int(-2147483647.5), INT_MIN + 1);
}

}  // namespace
}  // namespace sdftrack
