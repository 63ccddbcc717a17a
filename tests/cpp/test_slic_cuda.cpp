// SPDX-License-Identifier: MIT
// Superpixels on the GPU have the labels of the CPU's path; skipped where no GPU answers.
#include <gtest/gtest.h>

#include "base/cuda_probe.h"
#include "base/strided.h"
#include "superpixels/slic.h"

namespace sdftrack {
namespace {

std::vector<std::uint8_t> made_picture(int width, int height) {
  std::vector<std::uint8_t> bytes;
  unsigned state = 7;
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x)
      for (int k = 0; k < 3; ++k) {
        state = state * 1664525u + 1013904223u;
        bytes.push_back(static_cast<std::uint8_t>((x > 11 ? 120 : 30) + 3 * y + 10 * k + (state >> 27)));
      }
  return bytes;
}

struct Way {
  int width, height, segments, rounds;
  superpixels::SlicDistance distance = superpixels::SlicDistance::kSquared;
  bool connected = true, masked = false;
};

TEST(Strided, ends_where_the_next_number_is_beyond_an_int) {
  std::vector<int> seen;
  const auto note = [&](int i) { seen.push_back(i); };
  strided(5, (std::int64_t{1} << 31) - 256, (std::int64_t{1} << 31) - 65, note);
  strided((std::int64_t{1} << 31) - 66, std::int64_t{1} << 31, (std::int64_t{1} << 31) - 65, note);
  EXPECT_EQ(seen, (std::vector<int>{5, 2147483397, 2147483582}));
}

class SlicOnDevice : public testing::TestWithParam<Way> {};

TEST_P(SlicOnDevice, has_the_labels_of_the_cpu) {
  if (cuda_devices().empty()) GTEST_SKIP() << (cuda_built() ? "no CUDA device" : "a build without CUDA");
  const Way way = GetParam();
  const std::vector<std::uint8_t> bytes = made_picture(way.width, way.height);
  std::vector<std::uint8_t> mask(bytes.size() / 3, 1);
  for (std::size_t i = 0; i < mask.size(); i += 7) mask[i] = i % 3 != 0;
  superpixels::SlicImage image;
  image.bytes = bytes.data(), image.width = way.width, image.height = way.height;
  if (way.masked) image.mask = mask.data();
  superpixels::SlicOptions options;
  options.n_segments = way.segments, options.max_iterations = way.rounds;
  options.distance = way.distance, options.connected = way.connected;
  std::vector<int> requested(mask.size()), got(mask.size());
  const auto cpu = superpixels::Slic().run(image, options, false, 1, requested.data());
  const auto gpu = superpixels::slic_cuda(image, options, cuda_devices().front(), got.data());
  EXPECT_EQ(got, requested);
  EXPECT_EQ(gpu.iterations, cpu.iterations);
  EXPECT_EQ(gpu.segments, cpu.segments);
  EXPECT_NEAR(gpu.residual, cpu.residual, 1e-9 * (1 + cpu.residual));
}

using superpixels::SlicDistance;
INSTANTIATE_TEST_SUITE_P(
    Ways, SlicOnDevice,
    testing::Values(Way{26, 19, 9, 3}, Way{26, 19, 9, 3, SlicDistance::kThesis},
                    Way{26, 19, 9, 3, SlicDistance::kSquared, false},
                    Way{26, 19, 9, 3, SlicDistance::kSquared, true, true},
                    Way{40, 30, 50, 40},  // until nothing moves: more rounds than are started at once
                    Way{120, 3, 150, 5}, Way{1, 1, 1, 1}, Way{70, 70, 1, 4},  // a cell of more than one block
                    Way{26, 19, 9, 10}, Way{26, 19, 9, 11},  // all rounds at once, and one more
                    Way{90, 60, 700, 2}));                   // small regions, joined in several rounds

}  // namespace
}  // namespace sdftrack
