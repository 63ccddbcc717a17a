// SPDX-License-Identifier: MIT
// The kernels' source, run on the CPU, sums what the CPU's loops sum.
#include <gtest/gtest.h>

// In this order: the kernels are made of what stands above them.
// clang-format off
#include "gpu_on_cpu.h"
#include "energies/reduce_cuda.cuh"
// clang-format on
#include "energies/term_ops.h"
#include "term_fixture.h"

namespace sdftrack {
namespace {

using namespace energies;  // compiled.inc names its pairs so

static_assert(energies::kBlockThreads == gpu_on_cpu::kThreads);

constexpr double kRelative = 1e-5;  // sums of floats in another order

// n numbers of the blocks, added by the last kernel.
std::vector<double> totals(const std::vector<double>& partial, int blocks, int n) {
  std::vector<double> total(static_cast<std::size_t>(n));
  gpu_on_cpu::launch(1, [&] { add_blocks_kernel(partial.data(), blocks, n, total.data()); });
  return total;
}

template <class Field, class Penalty>
void expect_the_cpus_sums(int count, int blocks) {
  constexpr int P = Field::P;
  energies::PixelSet pixels = some_pixels(count), others = pixels;
  const energies::TermOps<Field, Penalty>& cpu = energies::OpsOf<Field, Penalty>::baseline;
  auto here = term_on<Field, Penalty>(others.view(), energies::Residual::kRayHit, true, 1);
  auto there = term_on<Field, Penalty>(pixels.view(), energies::Residual::kRayHit, true, 1);
  for (int step = 0; step < 2; ++step) cpu.settle(here, 0, count);
  gpu_on_cpu::launch(blocks, [&] { settle_kernel(there, 2); });
  EXPECT_EQ(pixels.hit_m, others.hit_m);

  const auto sums = cpu.linearize(here, 0, count);
  std::vector<double> partial(static_cast<std::size_t>(blocks) * energies::kSummed<P>);
  gpu_on_cpu::launch(blocks, [&] { linearize_kernel(there, partial.data()); });
  const std::vector<double> total = totals(partial, blocks, energies::kSummed<P>);
  EXPECT_EQ(pixels.gain, others.gain);
  EXPECT_NEAR(total[0], sums.cost, kRelative * sums.cost);
  double most = 0;
  for (const double g : sums.gradient) most = std::max(most, std::abs(g));
  for (std::size_t a = 0; a < P; ++a) EXPECT_NEAR(total[1 + a], sums.gradient[a], 1e-4 * most) << a;
  for (int a = 0, k = 0; a < P; ++a)
    for (int b = 0; b <= a; ++b, ++k) {
      const double size = std::sqrt(sums.hessian[a * (a + 1) / 2 + a] * sums.hessian[b * (b + 1) / 2 + b]);
      EXPECT_NEAR(total[static_cast<std::size_t>(1 + P + k)], sums.hessian[k], kRelative * size) << a << b;
    }

  here.reclassify = there.reclassify = false;
  const double cost = cpu.cost(here, 0, count);
  gpu_on_cpu::launch(blocks, [&] { cost_kernel(there, partial.data()); });
  EXPECT_NEAR(totals(partial, blocks, 1)[0], cost, kRelative * cost);
  EXPECT_EQ(pixels.hit_m, others.hit_m);
}

// 700 pixels: the last of three blocks is not full; in one block every thread has several.
#define SDFTRACK_PAIR(name, field, penalty)                                            \
  TEST(ReduceCuda, name##_is_what_the_cpu_sums) {                                      \
    for (const int blocks : {3, 1}) expect_the_cpus_sums<field, penalty>(700, blocks); \
  }
#include "energies/compiled.inc"
#undef SDFTRACK_PAIR

TEST(ReduceCuda, the_blocks_are_as_many_as_the_pixels_ask_for_up_to_a_limit) {
  EXPECT_EQ(energies::blocks_for(1), 1);
  EXPECT_EQ(energies::blocks_for(256), 1);
  EXPECT_EQ(energies::blocks_for(257), 2);
  EXPECT_EQ(energies::blocks_for(10'000'000), energies::kMaxBlocks);
}

}  // namespace
}  // namespace sdftrack
