// SPDX-License-Identifier: MIT
// The stand-in for CUDA shows the errors that it is there to show.
#ifdef SDFTRACK_CUDA_ON_CPU
#include <gtest/gtest.h>

#include <functional>
#include <numeric>
#include <string>
#include <vector>

#include "base/device_stream.h"
#include "base/launch.cuh"
#include "control.h"
#include "cuda_runtime.h"
#if defined(__SANITIZE_ADDRESS__)
#include <sanitizer/common_interface_defs.h>
#endif

namespace sdftrack {
namespace {

constexpr int kCount = 64;

class CudaOnCpu : public testing::Test {
 protected:
  void SetUp() override { cuda_on_cpu::reset({}); }
  void TearDown() override { cuda_on_cpu::reset({}); }
};

void reset_with(std::uint64_t seed) {
  cuda_on_cpu::Settings settings;
  settings.seed = seed;
  cuda_on_cpu::reset(settings);
}

// Turns the block's numbers round; `synced`: as it must be.
struct Reverse {
  static constexpr const char* kName = "reverse";
  static constexpr int kThreads = kCount;
  float* values;
  bool synced;
  void operator()() const {
    SDFTRACK_SHARED(float[kCount], held);
    held[threadIdx.x] = values[threadIdx.x];
    if (synced) __syncthreads();
    values[threadIdx.x] = held[kCount - 1 - threadIdx.x];
  }
};

std::vector<float> counted() {
  std::vector<float> out(kCount);
  std::iota(out.begin(), out.end(), 0.0f);
  return out;
}

std::vector<float> reversed(bool synced) {
  const DeviceStream stream;
  DeviceBuffer<float> there(kCount);
  std::vector<float> values = counted();
  stream.upload(values.data(), kCount, there.data());
  launch(stream, 1, Reverse{there.data(), synced});
  stream.download(there.data(), kCount, values.data());
  stream.wait();
  return values;
}

TEST_F(CudaOnCpu, a_barrier_that_is_missing_shows_in_the_result) {
  std::vector<float> requested = counted();
  std::reverse(requested.begin(), requested.end());
  EXPECT_EQ(reversed(true), requested);
  const std::vector<float> got = reversed(false);
  EXPECT_NE(got, requested);
}

struct HalfWaits {
  static constexpr const char* kName = "half waits";
  static constexpr int kThreads = kCount;
  void operator()() const {
    if (threadIdx.x < 32)
      __syncthreads();
    else
      __shfl_down_sync(0xffffffffu, 1, 1);
    __syncthreads();
    if (threadIdx.x == 5) __syncwarp();
  }
};

TEST_F(CudaOnCpu, threads_that_wait_at_different_places_are_an_error_not_a_hang) {
  const DeviceStream stream;
  launch(stream, 1, HalfWaits{});
  EXPECT_THROW(stream.wait(), CudaError);
  EXPECT_NE(cuda_on_cpu::last_message().find("kernel 'half waits': threads of a block wait for each other"),
            std::string::npos);
  EXPECT_THROW(stream.wait(), CudaError);  // the device is broken from then on
}

struct WriteAt {
  static constexpr const char* kName = "write";
  static constexpr int kThreads = 1;
  float* at;
  void operator()() const { *at = 1; }
};

// What ends a process on purpose reports to where the test reads, not to the file of the reports.
void report_here() {
#if defined(__SANITIZE_ADDRESS__)
  __sanitizer_set_report_path("stderr");
#endif
}

// AddressSanitizer ends the process at the access itself, one that reads as well.
void expect_an_error(const std::function<void()>& work) {
#if defined(__SANITIZE_ADDRESS__)
  EXPECT_DEATH((report_here(), work()), "use-after-poison");
#else
  EXPECT_THROW(work(), CudaError);
#endif
}

TEST_F(CudaOnCpu, a_write_beyond_an_allocation_is_an_error) {
  expect_an_error([] {
    const DeviceStream stream;
    DeviceBuffer<float> there(kCount);
    launch(stream, 1, WriteAt{there.data() + kCount});
    stream.wait();
  });
}

struct ReadAt {
  static constexpr const char* kName = "read";
  static constexpr int kThreads = 1;
  const float* at;
  float* to;
  void operator()() const { *to = *at; }
};

TEST_F(CudaOnCpu, the_host_cannot_read_device_memory) {
  const DeviceBuffer<float> there(kCount);
  EXPECT_DEATH((report_here(), static_cast<void>(*const_cast<volatile const float*>(there.data()))), "");
}

TEST_F(CudaOnCpu, a_write_into_memory_that_was_freed_is_an_error) {
  expect_an_error([] {
    const DeviceStream stream;
    float* const gone = DeviceBuffer<float>(kCount).data();
    launch(stream, 1, WriteAt{gone});
    stream.wait();
  });
}

std::string said_of(const char* kernel) {
#if defined(__SANITIZE_ADDRESS__)
  return std::string("AddressSanitizer|") + kernel;
#else
  return std::string("CUDA on the CPU: kernel '") + kernel + "' uses .*, which is no memory of its device";
#endif
}

void write_to_the_other_device() {
  cuda_on_cpu::Settings settings;
  settings.devices = 2;
  cuda_on_cpu::reset(settings);
  DeviceBuffer<float> here(kCount);
  const DeviceScope scope(1);
  const DeviceStream other;
  launch(other, 1, WriteAt{here.data()});
  other.wait();
}

TEST_F(CudaOnCpu, a_kernel_cannot_use_the_memory_of_another_device) {
  EXPECT_DEATH((report_here(), write_to_the_other_device()), said_of("write"));
}

// The process ends, and says which kernel it was. AddressSanitizer knows of the other devices' memory itself.
TEST_F(CudaOnCpu, a_kernel_that_reads_what_is_no_memory_is_named) {
  const auto work = [] {
    const DeviceStream stream;
    DeviceBuffer<float> there(1);
    launch(stream, 1, ReadAt{nullptr, there.data()});
    stream.wait();
  };
  EXPECT_DEATH((report_here(), work()), said_of("read"));
}

// A copy outside of the stream does not wait for it, nor the stream for the copy.
TEST_F(CudaOnCpu, a_copy_on_another_stream_may_come_too_late) {
  int stale = 0;
  for (std::uint64_t seed = 0; seed < 100; ++seed) {
    reset_with(seed);
    const DeviceStream stream;
    DeviceBuffer<float> there(kCount);
    std::vector<float> values = counted();
    SDFTRACK_CHECK_CUDA(
        cudaMemcpy(there.data(), values.data(), kCount * sizeof(float), cudaMemcpyHostToDevice));
    stream.download(there.data(), kCount, values.data());
    stream.wait();
    stale += values != counted();
  }
  EXPECT_GT(stale, 5);
  EXPECT_LT(stale, 95);
}

TEST_F(CudaOnCpu, pinned_memory_is_read_late) {
  int seen = 0;
  for (std::uint64_t seed = 0; seed < 50; ++seed) {
    reset_with(seed);
    const DeviceStream stream;
    DeviceBuffer<float> there(1);
    PinnedBuffer<float> host(1);
    *host.data() = 1;
    stream.upload(host.data(), 1, there.data());
    *host.data() = 2;
    float got = 0;
    stream.download(there.data(), 1, &got);
    stream.wait();
    seen += got == 2;
  }
  EXPECT_GT(seen, 5);
}

TEST_F(CudaOnCpu, memory_ends_and_comes_back) {
  cuda_on_cpu::fail_call(1, cudaErrorMemoryAllocation);
  DeviceBuffer<float> first(kCount), second;
  static int freed = 0;  // the list outlives this test
  IdleMemory::on_shortage([] { ++freed; });
  EXPECT_NE(second.room(kCount), nullptr);  // the second time
  EXPECT_EQ(cuda_on_cpu::failed_call(), "cudaMalloc");
  EXPECT_EQ(freed, 1);
  EXPECT_THROW(second.room(std::size_t{1} << 40), CudaError);
  EXPECT_EQ(freed, 2);
  EXPECT_EQ(second.size(), 0u);
  EXPECT_NE(second.room(kCount), nullptr);
  EXPECT_THROW(DeviceBuffer<float>(std::size_t{1} << 40), CudaError);
}

}  // namespace
}  // namespace sdftrack
#endif
