// SPDX-License-Identifier: MIT
// The sums on the GPU against those of the CPU; skipped where no GPU answers.
#include <gtest/gtest.h>

#include "base/cuda_probe.h"
#include "energies/cuda_work.h"
#include "energies/term_ops.h"
#include "term_fixture.h"

namespace sdftrack {
namespace {

using namespace energies;  // compiled.inc names its pairs so

constexpr double kRelative = 1e-4;  // the GPU contracts a * b + c, and sums in another order

template <class Field, class Penalty>
void expect_the_cpus_sums(int count) {
  if (!cuda_available()) GTEST_SKIP() << (cuda_built() ? "no CUDA device" : "a build without CUDA");
  energies::PixelSet pixels = some_pixels(count), others = pixels;
  const energies::TermOps<Field, Penalty>& cpu = energies::OpsOf<Field, Penalty>::baseline;
  using Gpu = energies::CudaOps<Field, Penalty>;
  energies::CudaWork work;
  auto here = term_on<Field, Penalty>(others.view(), energies::Residual::kSlope, true, 1);
  auto there = term_on<Field, Penalty>(work.upload(pixels), energies::Residual::kSlope, true, 1);
  on_device(&work, &there.field);
  const auto expected = cpu.linearize(here, 0, count);
  const auto sums = Gpu::linearize(&work, there);
  EXPECT_EQ(sums.count, count);
  EXPECT_NEAR(sums.cost, expected.cost, kRelative * expected.cost);
  for (int k = 0; k < Field::P * (Field::P + 1) / 2; ++k)
    EXPECT_NEAR(sums.hessian[k], expected.hessian[k], kRelative * (1 + std::abs(expected.hessian[0])));
  here.reclassify = there.reclassify = false;
  EXPECT_NEAR(Gpu::cost(&work, there), cpu.cost(here, 0, count), kRelative * expected.cost);
  work.download(&pixels);
  for (std::size_t i = 0; i < pixels.gain.size(); ++i) EXPECT_NEAR(pixels.gain[i], others.gain[i], 1e-3f);
  EXPECT_EQ(Gpu::linearize(&work, there).cost, Gpu::linearize(&work, there).cost);  // the same bits again
}

#define SDFTRACK_PAIR(name, field, penalty)                                                \
  TEST(CudaWork, name##_is_what_the_cpu_sums) {                                            \
    for (const int count : {1, 700, 100'000}) expect_the_cpus_sums<field, penalty>(count); \
  }
#include "energies/compiled.inc"
#undef SDFTRACK_PAIR

TEST(CudaWork, a_build_without_cuda_says_so) {
  if (cuda_built()) GTEST_SKIP() << "a build with CUDA";
  EXPECT_THROW(energies::CudaWork(), std::runtime_error);
}

}  // namespace
}  // namespace sdftrack
