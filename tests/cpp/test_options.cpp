// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <algorithm>
#include <set>
#include <stdexcept>

#include "contour/memory/options.h"
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
using AllOptions = testing::Types<tracking::TrackerOptions, contour::ContourOptions, contour::MemoryOptions,
                                  lwpr::LwprOptions, reconstruction::ReconstructionOptions>;
TYPED_TEST_SUITE(OptionSchema, AllOptions);

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

TEST(Options, a_float_is_shown_and_compared_with_its_fewest_digits) {
  EXPECT_EQ(decimal_of(0.05f), 0.05);
  contour::ContourOptions contour;
  contour.softness = 0.3f;  // the bound itself, no float
  EXPECT_EQ(refusal(contour), "");
}

}  // namespace
}  // namespace sdftrack
