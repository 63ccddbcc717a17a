// SPDX-License-Identifier: MIT
// Active fields: the search leaves out none, and their weights are those of the formula.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "lwpr/model.h"
#include "lwpr/search.h"

namespace sdftrack {
namespace {

// Blocks of some fields.
struct Fields {
  lwpr::FieldLayout at;
  std::vector<double> blocks;
  int count = 19;  // not a multiple of a block

  explicit Fields(int n) : at(n, false, true) {
    std::mt19937 random(5);
    std::uniform_real_distribution<double> place(-1, 1), some(0.5, 2);
    blocks.assign(static_cast<std::size_t>(3 * at.block_size()), std::nan(""));
    for (int k = 0; k < count; ++k) {
      double* const lane = blocks.data() + k / lwpr::kFieldLanes * at.block_size() + k % lwpr::kFieldLanes;
      for (int row = 0; row < at.block_rows(); ++row) lane[row * lwpr::kFieldLanes] = place(random);
      for (int i = 0; i < n; ++i) lane[(n + at.entry(i, i)) * lwpr::kFieldLanes] = some(random);
    }
  }
};

TEST(LwprUnitOps, a_list_of_all_fields_finds_what_looking_at_all_does) {
  const Fields fields(3);
  std::vector<int> list, index(64), other(64);
  for (int k = 0; k < fields.count; ++k) list.push_back(k);
  std::vector<double> w(64), v(64);
  const double x[] = {0.1, -0.2, 0.3};
  const lwpr::UnitOps& ops = for_isa<lwpr::UnitOps>(used_isa());
  const int a =
      ops.active(fields.at, {fields.blocks.data(), nullptr, fields.count}, x, 9, {index.data(), w.data()});
  const int b = ops.active(fields.at, {fields.blocks.data(), list.data(), fields.count}, x, 9,
                           {other.data(), v.data()});
  ASSERT_EQ(a, b);
  ASSERT_GT(a, 2);
  for (std::size_t i = 0; i < static_cast<std::size_t>(a); ++i) {
    EXPECT_EQ(index[i], other[i]);
    EXPECT_EQ(w[i], v[i]);
  }
}

TEST(LwprUnitOps, an_activation_is_that_of_the_formula) {
  const Fields fields(2);
  std::vector<int> index(64);
  std::vector<double> w(64);
  const double x[] = {0.1, -0.2};
  const int found =
      for_isa<lwpr::UnitOps>(used_isa())
          .active(fields.at, {fields.blocks.data(), nullptr, fields.count}, x, 20, {index.data(), w.data()});
  for (std::size_t i = 0; i < static_cast<std::size_t>(found); ++i) {
    const double* const lane = fields.blocks.data() + index[i] / lwpr::kFieldLanes * fields.at.block_size() +
                               index[i] % lwpr::kFieldLanes;
    const auto at = [&](int row) { return lane[row * lwpr::kFieldLanes]; };
    const double d0 = x[0] - at(0), d1 = x[1] - at(1);
    const double m0 = at(2) * d0 + at(3) * d1, m1 = at(4) * d1;
    EXPECT_NEAR(w[i], std::exp(-0.5 * (m0 * m0 + m1 * m1)), 1e-15);  // a few units in the last place of 1
  }
}

}  // namespace
}  // namespace sdftrack
