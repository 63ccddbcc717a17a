// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <set>
#include <stdexcept>

#include "contour/option_schema.h"
#include "lwpr/option_schema.h"
#include "reconstruction/option_schema.h"
#include "tracking/options/option_schema.h"
#include "tracking/tracker.h"

namespace sdftrack {
namespace {

// Anything that a member may be initialised with.
struct Anything {
  template <class T>
  operator T() const;  // NOLINT: an implicit conversion is what counts members
};

// Members of an aggregate: as many as braces take.
template <class T, class... Given>
constexpr std::size_t member_count() {
  if constexpr (requires { T{Given{}..., Anything{}}; })
    return member_count<T, Given..., Anything>();
  else
    return sizeof...(Given);
}

template <class Options>
std::string refusal(const Options& options) {
  try {
    check_options(options);
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "";
}

template <class Options>
class OptionSchema : public testing::Test {};
using AllOptions = testing::Types<tracking::TrackerOptions, contour::ContourOptions, lwpr::LwprOptions,
                                  reconstruction::ReconstructionOptions>;
TYPED_TEST_SUITE(OptionSchema, AllOptions);

TYPED_TEST(OptionSchema, the_defaults_are_within_their_bounds) { EXPECT_EQ(refusal(TypeParam{}), ""); }

TYPED_TEST(OptionSchema, every_option_has_a_name_of_its_own_and_a_meaning) {
  std::set<std::string> names;
  for (const OptionDescription& option : describe_options(TypeParam{})) {
    EXPECT_TRUE(names.insert(option.name).second) << option.name;
    EXPECT_GT(option.meaning.size(), 5u) << option.name;
  }
}

TYPED_TEST(OptionSchema, every_line_stands_for_a_member_of_its_own) {
  std::set<const void*> members;
  TypeParam options;
  const auto look = [&](const char* name, auto& member, const auto&, const char*, const char*) {
    EXPECT_TRUE(members.insert(&member).second) << name;
  };
  visit_options(options, look);
}

TEST(Options, every_member_of_the_plain_structs_is_described) {
  EXPECT_EQ(describe_options(tracking::TrackerOptions{}).size(), member_count<tracking::TrackerOptions>());
  EXPECT_EQ(describe_options(contour::ContourOptions{}).size(), member_count<contour::ContourOptions>());
  EXPECT_EQ(describe_options(lwpr::LwprOptions{}).size(), member_count<lwpr::LwprOptions>());
}

TEST(Options, ends_lie_in_a_range_unless_it_is_open_there) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_TRUE(lies_in(from_to(1, 2), 1) && lies_in(from_to(1, 2), 2));
  EXPECT_FALSE(lies_in(above(1), 1) || lies_in(from_to(1, 2).below(2), 2));
  EXPECT_FALSE(lies_in(either(1, 3), 2) || lies_in(OptionRange{}, nan));
}

TEST(Options, a_float_is_shown_and_compared_with_its_fewest_digits) {
  EXPECT_EQ(decimal_of(0.05f), 0.05);
  contour::ContourOptions contour;
  contour.softness = 0.3f;  // the bound itself, no float
  EXPECT_EQ(refusal(contour), "");
}

TEST(Options, bounds_between_options_are_checked_too) {
  lwpr::LwprOptions lwpr;
  lwpr.w_prune = 0.1;
  EXPECT_THROW(lwpr::check_lwpr_options(lwpr), std::invalid_argument);
  lwpr = {};
  lwpr.w_cutoff = 0.5;
  EXPECT_THROW(lwpr::check_lwpr_options(lwpr), std::invalid_argument);
}

}  // namespace
}  // namespace sdftrack
