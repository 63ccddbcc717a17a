// SPDX-License-Identifier: MIT
// Devices, streams, events and launches of the runtime.
#include <algorithm>
#include <cstdio>

#include "block.h"
#include "cuda_runtime.h"
#include "machine.h"

using namespace cuda_on_cpu;

namespace {

constexpr unsigned kMostThreads = 1024, kMultiprocessors = 4;

// What was queued has been done when the wait is over, or never will be, whatever error the wait tells: the
// host may free what the queue has read.
cudaError_t waited(Machine& m, const char* call, const std::function<bool()>& done) {
  ++m.waits;
  m.run_until(done);
  return m.broken == cudaSuccess ? m.due(call) : m.failed(m.broken);
}

}  // namespace

const char* cudaGetErrorName(cudaError_t error) {
  switch (error) {
    case cudaSuccess:
      return "cudaSuccess";
    case cudaErrorInvalidValue:
      return "cudaErrorInvalidValue";
    case cudaErrorMemoryAllocation:
      return "cudaErrorMemoryAllocation";
    case cudaErrorInvalidDevicePointer:
      return "cudaErrorInvalidDevicePointer";
    case cudaErrorNoDevice:
      return "cudaErrorNoDevice";
    case cudaErrorInvalidDevice:
      return "cudaErrorInvalidDevice";
    case cudaErrorInvalidResourceHandle:
      return "cudaErrorInvalidResourceHandle";
    case cudaErrorIllegalAddress:
      return "cudaErrorIllegalAddress";
    case cudaErrorLaunchOutOfResources:
      return "cudaErrorLaunchOutOfResources";
    case cudaErrorLaunchFailure:
      return "cudaErrorLaunchFailure";
    case cudaErrorNotSupported:
      return "cudaErrorNotSupported";
  }
  return "unknown error";
}
const char* cudaGetErrorString(cudaError_t) { return "made up by the stand-in"; }

cudaError_t cudaGetLastError() {
  const std::lock_guard lock(Machine::mutex());
  return Machine::one().last_error();
}

cudaError_t cudaGetDeviceCount(int* count) {
  const std::lock_guard lock(Machine::mutex());
  *count = Machine::one().settings().devices;
  return *count > 0 ? cudaSuccess : Machine::one().failed(cudaErrorNoDevice);
}
cudaError_t cudaGetDevice(int* device) {
  *device = current_device;
  return cudaSuccess;
}
cudaError_t cudaSetDevice(int device) {
  const std::lock_guard lock(Machine::mutex());
  Machine& m = Machine::one();
  if (device < 0 || device >= m.settings().devices) return m.failed(cudaErrorInvalidDevice);
  current_device = device;
  return cudaSuccess;
}
cudaError_t cudaGetDeviceProperties(cudaDeviceProp* properties, int device) {
  ENTER("cudaGetDeviceProperties");
  if (device < 0 || device >= m.settings().devices) return m.failed(cudaErrorInvalidDevice);
  *properties = {};
  std::snprintf(properties->name, sizeof properties->name, "CUDA on the CPU %d", device);
  properties->uuid.bytes[15] = static_cast<char>(device);
  properties->major = m.settings().compute_major;
  properties->multiProcessorCount = kMultiprocessors;
  properties->totalGlobalMem = m.memory[static_cast<std::size_t>(device)]->bytes();
  return cudaSuccess;
}
cudaError_t cudaDeviceGetAttribute(int* value, cudaDeviceAttr attribute, int device) {
  ENTER("cudaDeviceGetAttribute");
  if (device < 0 || device >= m.settings().devices) return m.failed(cudaErrorInvalidDevice);
  *value = attribute == cudaDevAttrComputeCapabilityMajor ? m.settings().compute_major : 0;
  return cudaSuccess;
}
cudaError_t cudaDeviceSynchronize() {
  ENTER_WAIT;
  return waited(m, "cudaDeviceSynchronize", [&m] {
    return std::all_of(m.streams.begin(), m.streams.end(),
                       [](const auto& s) { return s->device != current_device || s->work.empty(); });
  });
}
cudaError_t cudaDriverGetVersion(int* version) { return *version = 0, cudaSuccess; }
cudaError_t cudaRuntimeGetVersion(int* version) { return *version = 0, cudaSuccess; }

cudaError_t cudaStreamCreateWithFlags(cudaStream_t* stream, unsigned flags) {
  ENTER("cudaStreamCreateWithFlags");
  if (flags != cudaStreamNonBlocking) return m.failed(cudaErrorNotSupported);
  m.streams.push_back(std::make_unique<Stream>());
  m.streams.back()->device = current_device;
  *stream = m.streams.back().get();
  return cudaSuccess;
}
cudaError_t cudaStreamDestroy(cudaStream_t stream) {
  const std::lock_guard lock(Machine::mutex());
  Machine& m = Machine::one();
  if (!stream || !m.stream(stream)) return m.failed(cudaErrorInvalidResourceHandle);
  stream->destroyed = true;  // what waits in it runs all the same, some time
  m.forget_streams();
  return cudaSuccess;
}
cudaError_t cudaStreamSynchronize(cudaStream_t stream) {
  ENTER_WAIT;
  Stream* const s = m.stream(stream);
  if (!s) return m.failed(cudaErrorInvalidResourceHandle);
  return waited(m, "cudaStreamSynchronize", [s] { return s->work.empty(); });
}
cudaError_t cudaStreamWaitEvent(cudaStream_t stream, cudaEvent_t event, unsigned) {
  ENTER("cudaStreamWaitEvent");
  Stream* const s = m.stream(stream);
  if (!s || !m.events.contains(event)) return m.failed(cudaErrorInvalidResourceHandle);
  m.add(s, {nullptr, event->mark});
  return cudaSuccess;
}

cudaError_t cudaEventCreateWithFlags(cudaEvent_t* event, unsigned) {
  ENTER("cudaEventCreateWithFlags");
  auto made = std::make_unique<Event>();
  *event = made.get();
  m.events[*event] = std::move(made);
  return cudaSuccess;
}
cudaError_t cudaEventDestroy(cudaEvent_t event) {
  const std::lock_guard lock(Machine::mutex());
  return Machine::one().events.erase(event) ? cudaSuccess
                                            : Machine::one().failed(cudaErrorInvalidResourceHandle);
}
// Each record is a mark of its own: those who wait for an earlier one are not held up by a later one.
cudaError_t cudaEventRecord(cudaEvent_t event, cudaStream_t stream) {
  ENTER("cudaEventRecord");
  Stream* const s = m.stream(stream);
  if (!s || !m.events.contains(event)) return m.failed(cudaErrorInvalidResourceHandle);
  auto mark = std::make_shared<Mark>();
  mark->done = false;
  event->mark = mark;
  m.add(s, {[mark] { mark->done = true; }, nullptr});
  return cudaSuccess;
}
cudaError_t cudaEventSynchronize(cudaEvent_t event) {
  ENTER_WAIT;
  if (!m.events.contains(event)) return m.failed(cudaErrorInvalidResourceHandle);
  return waited(m, "cudaEventSynchronize", [mark = event->mark] { return mark->done; });
}

cudaError_t cuda_on_cpu::enqueue_grid(const cudaLaunchConfig_t& config, const char* name,
                                      std::function<void()> as_each_thread) {
  ENTER("cudaLaunchKernelEx");
  Stream* const s = m.stream(config.stream);
  const dim3 g = config.gridDim, b = config.blockDim;
  if (!s) return m.failed(cudaErrorInvalidResourceHandle);
  const std::uint64_t threads = std::uint64_t{b.x} * b.y * b.z;
  if (threads == 0 || threads > kMostThreads || g.x == 0 || g.y == 0 || g.z == 0 || g.y > 65535 ||
      g.z > 65535 || s->device != current_device)
    return m.failed(cudaErrorInvalidValue);
  const std::uint64_t seed = m.random();
  m.add(s, {[=, &m] {
              ++m.kernels;
              run_grid({g.x, g.y, g.z}, {b.x, b.y, b.z}, seed, as_each_thread);
            },
            nullptr, name});
  return cudaSuccess;
}
