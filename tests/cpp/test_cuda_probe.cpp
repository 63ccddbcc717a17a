// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <cmath>
#include <stdexcept>

#include "base/cuda_probe.h"

#ifdef SDFTRACK_WITH_CUDA
#include "base/device_stream.h"
#endif

namespace sdftrack {
namespace {

constexpr std::size_t kCount = 1000;  // not a multiple of the block size
// The GPU fuses a * x + y into one rounding, the CPU is told not to: they may differ in the last bit of a *
// x.
constexpr float kTolerance = 2e-6F;

std::vector<float> wave(float phase) {
  std::vector<float> out(kCount);
  for (std::size_t i = 0; i < kCount; ++i) out[i] = std::sin(phase + 0.1F * static_cast<float>(i));
  return out;
}

TEST(CudaProbe, the_cpu_scales_and_adds) {
  EXPECT_EQ(scale_and_add_cpu(2, {1, 2, 3}, {10, 20, 30}), (std::vector<float>{12, 24, 36}));
}

TEST(CudaProbe, lengths_that_differ_are_refused) {
  EXPECT_THROW(scale_and_add_cpu(1, {1, 2}, {1}), std::invalid_argument);
}

TEST(CudaProbe, the_gpu_computes_what_the_cpu_does) {
  if (cuda_devices().empty()) GTEST_SKIP() << "no CUDA device: the kernel was compiled and linked, not run";
  const std::vector<float> x = wave(0), y = wave(1);
  const std::vector<float> cpu = scale_and_add_cpu(1.5F, x, y),
                           gpu = scale_and_add_cuda(1.5F, x, y, cuda_devices().front());
  ASSERT_EQ(cpu.size(), gpu.size());
  for (std::size_t i = 0; i < kCount; ++i) EXPECT_NEAR(cpu[i], gpu[i], kTolerance);
}

#ifdef SDFTRACK_WITH_CUDA
TEST(CudaProbe, a_failing_cuda_call_is_an_exception_that_carries_the_call) {
  try {
    SDFTRACK_CHECK_CUDA(cudaErrorInvalidValue);
    FAIL() << "expected a CudaError";
  } catch (const CudaError& e) {
    EXPECT_NE(std::string(e.what()).find("cudaErrorInvalidValue"), std::string::npos);
  }
}

TEST(CudaProbe, without_a_device_gpu_memory_is_refused_by_an_exception) {
  if (!cuda_devices().empty()) GTEST_SKIP() << "a CUDA device is here";
  EXPECT_THROW(DeviceBuffer<float>(16), CudaError);
}

TEST(CudaProbe, a_buffer_that_grows_is_empty_after_memory_has_ended) {
  if (cuda_devices().empty()) GTEST_SKIP() << "no CUDA device";
  DeviceBuffer<float> buffer(16);
  float* const before = buffer.data();
  EXPECT_EQ(buffer.room(8), before);
  EXPECT_THROW(buffer.room(std::size_t{1} << 50), CudaError);
  EXPECT_EQ(buffer.size(), 0u);
  EXPECT_NE(buffer.room(32), nullptr);
}
#else
TEST(CudaProbe, a_build_without_cuda_says_so) {
  EXPECT_TRUE(cuda_devices().empty());
  EXPECT_THROW(scale_and_add_cuda(1, {1}, {1}, 0), std::runtime_error);
}
#endif

}  // namespace
}  // namespace sdftrack
