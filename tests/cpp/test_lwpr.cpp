// SPDX-License-Identifier: MIT
// The loops over fields give the same bits on every instruction set; the search leaves out nothing.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <random>

#include "lwpr/model.h"
#include "lwpr/search.h"

namespace sdftrack {
namespace {

// Blocks and records of some fields with one projection for each of up to two inputs.
struct Fields {
  lwpr::FieldLayout at;
  std::vector<double> blocks, records;
  long stride;
  int count = 19;  // not a multiple of a block

  Fields(int n, bool diagonal) : at(n, diagonal, true), stride(at.record_size(n < 2 ? n : 2)) {
    std::mt19937 random(5);
    std::uniform_real_distribution<double> place(-1, 1), some(0.5, 2);
    blocks.assign(static_cast<std::size_t>(3 * at.block_size()), std::nan(""));
    records.assign(static_cast<std::size_t>(count * stride), 0.0);
    for (int k = 0; k < count; ++k) {
      double* const lane = blocks.data() + k / lwpr::kFieldLanes * at.block_size() + k % lwpr::kFieldLanes;
      for (int row = 0; row < at.block_rows(); ++row) lane[row * lwpr::kFieldLanes] = place(random);
      for (int i = 0; i < n; ++i) lane[(n + at.entry(i, i)) * lwpr::kFieldLanes] = some(random);
      double* const head = records.data() + k * stride;
      head[lwpr::FieldLayout::kLambda] = 0.99;
      head[lwpr::FieldLayout::kProjections] = n < 2 ? n : 2;
      for (int r = 0; r < (n < 2 ? n : 2); ++r) {
        head[at.record_size(r) + lwpr::FieldLayout::kSS] = lwpr::kSsFloor;
        head[at.record_size(r) + at.u() + r] = 1;
      }
      for (int e = 0; e < at.metric_size(); ++e) head[at.alpha() + e] = 5;
    }
  }
};

std::vector<unsigned char> bytes_of(const lwpr::UnitOps& ops, int n, bool diagonal) {
  Fields fields(n, diagonal);
  std::vector<int> index(64);
  std::vector<double> w(64), scratch(static_cast<std::size_t>(lwpr::scratch_size(fields.at)));
  const lwpr::ActiveFields active{index.data(), w.data()};
  const lwpr::FieldSettings settings{true, true, 1, 1e-3, 0.9, 0.9999, 0.99};
  std::mt19937 random(6);
  std::uniform_real_distribution<double> place(-1, 1);
  std::vector<double> said;
  for (int i = 0; i < 200; ++i) {
    std::vector<double> x(static_cast<std::size_t>(fields.at.row), 0.0);
    for (int j = 0; j < n; ++j) x[static_cast<std::size_t>(j)] = place(random);
    const lwpr::FieldList all{fields.blocks.data(), nullptr, fields.count};
    const int found = ops.active(fields.at, all, x.data(), 9, active);
    ops.learn(fields.at, settings, fields.blocks.data(), fields.records.data(), fields.stride, scratch.data(),
              x.data(), std::sin(3 * x[0]), active, found);
    const lwpr::FieldSums sums = ops.predict(fields.at, all, x.data(), 9, active);
    said.insert(said.end(), {static_cast<double>(found), sums.w, sums.wy});
  }
  said.insert(said.end(), fields.records.begin(), fields.records.end());
  for (const double value : fields.blocks)
    if (std::isfinite(value)) said.push_back(value);
  std::vector<unsigned char> out(said.size() * sizeof(double));
  std::memcpy(out.data(), said.data(), out.size());
  return out;
}

TEST(LwprUnitOps, every_instruction_set_gives_the_same_bits) {
  for (const int n : {1, 2, 3, 4, 7})
    for (const bool diagonal : {false, true}) {
      const auto expected = bytes_of(for_isa<lwpr::UnitOps>(Isa::kBaseline), n, diagonal);
      for (const Isa isa : supported_isas())
        EXPECT_EQ(expected, bytes_of(for_isa<lwpr::UnitOps>(isa), n, diagonal))
            << isa_name(isa) << " n " << n;
    }
}

TEST(LwprUnitOps, a_list_of_all_fields_finds_what_looking_at_all_does) {
  const Fields fields(3, false);
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
  const Fields fields(2, false);
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
