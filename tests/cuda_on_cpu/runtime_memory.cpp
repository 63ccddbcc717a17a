// SPDX-License-Identifier: MIT
// Memory and copies of the runtime.
#include <cstdlib>
#include <cstring>
#include <memory>

#include "machine.h"

using namespace cuda_on_cpu;

namespace {

// An access of the host is that of its own memory; one of the device must lie in one allocation.
bool fits(Machine& m, const void* pointer, std::size_t bytes, bool on_device) {
  const DeviceMemory* const memory = m.memory_of(pointer);
  return on_device ? memory && memory->holds(pointer, bytes) : !memory && pointer;
}

bool is_pinned(const Machine& m, const void* pointer) {
  auto next = m.pinned.upper_bound(static_cast<const char*>(pointer));
  return next != m.pinned.begin() &&
         static_cast<const char*>(pointer) < std::prev(next)->first + std::prev(next)->second;
}

// A pointer may be of another device than the stream: that one's memory is opened, too.
void move(Machine* m, void* to, const void* from, std::size_t bytes) {
  DeviceMemory* const a = m->memory_of(to);
  DeviceMemory* const b = m->memory_of(from);
  if (a) a->open();
  if (b) b->open();
  std::memmove(to, from, bytes);
  if (a) a->close();
  if (b) b->close();
}

cudaError_t copy(Machine& m, void* to, const void* from, std::size_t bytes, cudaMemcpyKind kind, Stream* s) {
  if (bytes == 0) return cudaSuccess;
  const bool to_device = kind == cudaMemcpyHostToDevice, from_device = kind == cudaMemcpyDeviceToHost;
  if (!s) return m.failed(cudaErrorInvalidResourceHandle);
  if (!fits(m, to, bytes, to_device) || !fits(m, from, bytes, from_device))
    return m.failed(cudaErrorInvalidValue);
  Machine* const machine = &m;
  m.bytes_copied += static_cast<std::int64_t>(bytes);
  if (!from_device && !is_pinned(m, from) && !m.settings().late_pageable) {  // read at once
    std::shared_ptr<char[]> held(new char[bytes]);
    std::memcpy(held.get(), from, bytes);
    m.add(s, {[=] { move(machine, to, held.get(), bytes); }, nullptr});
  } else {
    m.add(s, {[=] { move(machine, to, from, bytes); }, nullptr});
  }
  return cudaSuccess;
}

cudaError_t finish(Machine& m, Stream* s) {
  m.run_until([s] { return s->work.empty(); });
  return m.broken == cudaSuccess ? cudaSuccess : m.failed(m.broken);
}

}  // namespace

cudaError_t cudaMalloc(void** pointer, std::size_t bytes) {
  ENTER("cudaMalloc");
  if (bytes == 0) return *pointer = nullptr, cudaSuccess;
  void* const got = m.memory[static_cast<std::size_t>(current_device)]->allocate(bytes);
  if (!got) return m.failed(cudaErrorMemoryAllocation);
  *pointer = got;
  return cudaSuccess;
}

// Waits for all that may still use it.
cudaError_t cudaFree(void* pointer) {
  const std::lock_guard lock(Machine::mutex());
  Machine& m = Machine::one();
  if (!pointer) return cudaSuccess;
  m.run_until([] { return false; });
  DeviceMemory* const memory = m.memory_of(pointer);
  return memory && memory->free(pointer) ? cudaSuccess : m.failed(cudaErrorInvalidDevicePointer);
}

cudaError_t cudaMallocHost(void** pointer, std::size_t bytes) {
  ENTER("cudaMallocHost");
  if (bytes == 0) return *pointer = nullptr, cudaSuccess;
  auto* const got = static_cast<char*>(std::malloc(bytes));
  if (!got) return m.failed(cudaErrorMemoryAllocation);
  std::memset(got, 0xff, bytes);
  m.pinned[got] = bytes, *pointer = got;
  return cudaSuccess;
}

cudaError_t cudaFreeHost(void* pointer) {
  const std::lock_guard lock(Machine::mutex());
  Machine& m = Machine::one();
  if (!pointer) return cudaSuccess;
  m.run_until([] { return false; });
  if (!m.pinned.erase(static_cast<char*>(pointer))) return m.failed(cudaErrorInvalidValue);
  std::free(pointer);
  return cudaSuccess;
}

cudaError_t cudaPointerGetAttributes(cudaPointerAttributes* out, const void* pointer) {
  ENTER("cudaPointerGetAttributes");
  *out = {cudaMemoryTypeUnregistered, -1, nullptr, const_cast<void*>(pointer)};
  if (m.memory_of(pointer, &out->device))
    *out = {cudaMemoryTypeDevice, out->device, const_cast<void*>(pointer), nullptr};
  else if (is_pinned(m, pointer))
    out->type = cudaMemoryTypeHost;
  return cudaSuccess;
}

// To the device it may return before the last bytes have arrived; from there it waits.
cudaError_t cudaMemcpy(void* to, const void* from, std::size_t bytes, cudaMemcpyKind kind) {
  ENTER("cudaMemcpy");
  Stream* const s = m.stream(nullptr);
  if (const cudaError_t error = copy(m, to, from, bytes, kind, s)) return error;
  return m.memory_of(to) ? cudaSuccess : finish(m, s);
}

cudaError_t cudaMemcpyAsync(void* to, const void* from, std::size_t bytes, cudaMemcpyKind kind,
                            cudaStream_t stream) {
  ENTER("cudaMemcpyAsync");
  return copy(m, to, from, bytes, kind, m.stream(stream));
}

cudaError_t cudaMemsetAsync(void* to, int value, std::size_t bytes, cudaStream_t stream) {
  ENTER("cudaMemsetAsync");
  Stream* const s = m.stream(stream);
  if (bytes == 0) return cudaSuccess;
  if (!s || !fits(m, to, bytes, true)) return m.failed(cudaErrorInvalidValue);
  m.add(s, {[=] { std::memset(to, value, bytes); }, nullptr});
  return cudaSuccess;
}
