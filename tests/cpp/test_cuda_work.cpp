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

template <int P>
void expect_near(const energies::Sums<double, P>& got, const energies::Sums<double, P>& requested) {
  EXPECT_EQ(got.count, requested.count);
  EXPECT_NEAR(got.cost, requested.cost, kRelative * requested.cost);
  double most = 0;
  for (const double g : requested.gradient) most = std::max(most, std::abs(g));
  for (int a = 0; a < P; ++a) EXPECT_NEAR(got.gradient[a], requested.gradient[a], kRelative * most) << a;
  for (int a = 0, k = 0; a < P; ++a)
    for (int b = 0; b <= a; ++b, ++k) {
      const double size =
          std::sqrt(requested.hessian[a * (a + 1) / 2 + a] * requested.hessian[b * (b + 1) / 2 + b]);
      EXPECT_NEAR(got.hessian[k], requested.hessian[k], kRelative * (size + 1e-6)) << a << ' ' << b;
    }
}

// The same bits on every run.
template <class Field, class Penalty>
double cost_afresh(const energies::PixelSet& pixels, energies::Residual residual) {
  energies::CudaWork work(cuda_devices().front());
  auto term = term_on<Field, Penalty>(work.upload(pixels), residual, false, 1);
  on_device(&work, &term.field);
  return energies::CudaOps<Field, Penalty>::cost(&work, term);
}

template <class Field, class Penalty>
void expect_the_cpus_sums(int count, energies::Residual residual) {
  energies::PixelSet pixels = some_pixels(count), others = pixels;
  const energies::TermOps<Field, Penalty>& cpu = energies::OpsOf<Field, Penalty>::baseline;
  using Gpu = energies::CudaOps<Field, Penalty>;
  energies::CudaWork work(cuda_devices().front());
  auto here = term_on<Field, Penalty>(others.view(), residual, true, 1);
  auto there = term_on<Field, Penalty>(work.upload(pixels), residual, true, 1);
  on_device(&work, &there.field);
  if (residual == energies::Residual::kRayHit) {
    for (int step = 0; step < 2; ++step) cpu.settle(here, 0, count);
    Gpu::settle(&work, there, 2);
  }
  expect_near(Gpu::linearize(&work, there), cpu.linearize(here, 0, count));
  here.reclassify = there.reclassify = false;
  const double cost = cpu.cost(here, 0, count);
  EXPECT_NEAR(Gpu::cost(&work, there), cost, kRelative * cost);
  work.download(&pixels);
  int apart = 0;
  for (std::size_t i = 0; i < pixels.gain.size(); ++i) {
    EXPECT_NEAR(pixels.gain[i], others.gain[i], 1e-3f);
    apart += std::abs(pixels.hit_m[i] - others.hit_m[i]) > 1e-5f;
  }
  EXPECT_LE(apart, count / 1000);  // a ray that grazes an edge may go either way
  EXPECT_EQ((cost_afresh<Field, Penalty>(pixels, residual)), (cost_afresh<Field, Penalty>(pixels, residual)));
}

#define SDFTRACK_PAIR(name, field, penalty)                                                                 \
  TEST(CudaWork, name##_is_what_the_cpu_sums) {                                                             \
    if (cuda_devices().empty()) GTEST_SKIP() << (cuda_built() ? "no CUDA device" : "a build without CUDA"); \
    for (const int count : {1, 700, 100'000})                                                               \
      for (const auto residual : {energies::Residual::kSlope, energies::Residual::kRayHit})                 \
        expect_the_cpus_sums<field, penalty>(count, residual);                                              \
  }
#include "energies/compiled.inc"
#undef SDFTRACK_PAIR

}  // namespace
}  // namespace sdftrack
