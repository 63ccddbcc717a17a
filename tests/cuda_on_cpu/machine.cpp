// SPDX-License-Identifier: MIT
#include "machine.h"

#include <cstdlib>
#include <sstream>
#include <stdexcept>
#include <utility>

#include "fault_message.h"

namespace cuda_on_cpu {

thread_local int current_device = 0;

namespace {

thread_local cudaError_t last = cudaSuccess;

// "seed=7,devices=2,megabytes=512,early=0.5,late=1,major=6"
Settings from_environment() {
  Settings out;
  const char* const text = std::getenv("SDFTRACK_CUDA_ON_CPU");
  std::istringstream in(text ? text : "");
  for (std::string item; std::getline(in, item, ',');) {
    const auto at = item.find('=');
    if (at == std::string::npos) continue;
    const std::string name = item.substr(0, at);
    const double value = std::atof(item.c_str() + at + 1);
    if (name == "seed") out.seed = static_cast<std::uint64_t>(value);
    if (name == "devices") out.devices = static_cast<int>(value);
    if (name == "megabytes") out.bytes = static_cast<std::size_t>(value * (1 << 20));
    if (name == "early") out.early = value;
    if (name == "late") out.late_pageable = value != 0;
    if (name == "major") out.compute_major = static_cast<int>(value);
  }
  return out;
}

}  // namespace

std::recursive_mutex& Machine::mutex() {
  static std::recursive_mutex lock;
  return lock;
}

Machine& Machine::one() {
  static Machine* const machine = new Machine;  // outlives every static object that frees memory
  return *machine;
}

Machine::Machine() { reset(from_environment()); }

void Machine::reset(const Settings& settings) {
  run_until([] { return false; });
  forget_streams();
  calls = kernels = waits = bytes_copied = 0, fail_after = -1, broken = cudaSuccess, failed_call.clear(),
  message.clear();
  settings_ = settings;
  random.seed(settings.seed);
  while (static_cast<int>(memory.size()) < settings.devices) {
    memory.push_back(std::make_unique<DeviceMemory>(settings.bytes));
    auto own = std::make_unique<Stream>();
    own->device = static_cast<int>(memory.size()) - 1;
    streams.insert(streams.begin() + own->device, std::move(own));
  }
  last = cudaSuccess;
}

cudaError_t Machine::refused() {
  ++calls;
  if (broken != cudaSuccess) return failed(broken);
  if (current_device >= settings_.devices)
    return failed(settings_.devices == 0 ? cudaErrorNoDevice : cudaErrorInvalidDevice);
  return cudaSuccess;
}

cudaError_t Machine::due(const char* call) {
  if (fail_after > 0) {
    --fail_after;
  } else if (fail_after == 0) {
    if (--fail_times <= 0) fail_after = -1;
    failed_call = call;
    return failed(fail_with);
  }
  return cudaSuccess;
}

cudaError_t Machine::failed(cudaError_t error) { return last = error; }

cudaError_t Machine::last_error() {
  const cudaError_t error = std::exchange(last, cudaSuccess);
  return broken != cudaSuccess ? broken : error;
}

Stream* Machine::stream(cudaStream_t given) {
  if (reinterpret_cast<std::uintptr_t>(given) <= 2)  // the default ones, by name too
    return streams[static_cast<std::size_t>(current_device)].get();
  for (const auto& one : streams)
    if (one.get() == given && !one->destroyed) return given;
  return nullptr;
}

void Machine::forget_streams() {
  std::erase_if(streams, [](const auto& s) { return s->destroyed && s->work.empty(); });
}

void Machine::add(Stream* stream, Work work) {
  stream->work.push_back(std::move(work));
  while (std::uniform_real_distribution<>()(random) < settings_.early && run_one()) {
  }
}

// A random stream's first work that need not wait.
bool Machine::run_one() {
  std::vector<Stream*> ready;
  for (const auto& s : streams)
    if (!s->work.empty() && (!s->work.front().until || s->work.front().until->done)) ready.push_back(s.get());
  if (ready.empty()) return false;
  Stream& s = *ready[random() % ready.size()];
  const Work work = std::move(s.work.front());
  s.work.pop_front();
  if (!work.run || broken != cudaSuccess) return true;
  DeviceMemory& own = *memory[static_cast<std::size_t>(s.device)];
  const std::string in = work.kernel ? std::string("kernel '") + work.kernel + "': " : "";
  const FaultMessage on_fault(work.kernel);
  own.open();
  try {
    work.run();
  } catch (const std::exception& error) {
    broken = cudaErrorLaunchFailure, message = in + error.what();
  }
  if (!own.close() && broken == cudaSuccess)
    broken = cudaErrorIllegalAddress,
    message = in + "a write beyond an allocation, or into one that was freed";
  return true;
}

bool Machine::run_until(const std::function<bool()>& done) {
  while (!done())
    if (!run_one()) return done();
  return true;
}

DeviceMemory* Machine::memory_of(const void* pointer, int* device) {
  for (std::size_t k = 0; k < memory.size(); ++k)
    if (memory[k]->owns(pointer)) {
      if (device) *device = static_cast<int>(k);
      return memory[k].get();
    }
  return nullptr;
}

void reset(const Settings& settings) {
  const std::lock_guard lock(Machine::mutex());
  Machine::one().reset(settings);
}
Settings settings() {
  const std::lock_guard lock(Machine::mutex());
  return Machine::one().settings();
}
void fail_call(std::int64_t calls, cudaError_t error, int times) {
  const std::lock_guard lock(Machine::mutex());
  Machine& m = Machine::one();
  m.fail_after = calls, m.fail_with = error, m.fail_times = times, m.failed_call.clear();
}
std::int64_t calls() {
  const std::lock_guard lock(Machine::mutex());
  return Machine::one().calls;
}
std::string failed_call() {
  const std::lock_guard lock(Machine::mutex());
  return Machine::one().failed_call;
}
std::size_t bytes_in_use() {
  const std::lock_guard lock(Machine::mutex());
  std::size_t total = 0;
  for (const auto& one : Machine::one().memory) total += one->bytes_in_use();
  return total;
}
std::int64_t kernels_run() {
  const std::lock_guard lock(Machine::mutex());
  return Machine::one().kernels;
}
std::int64_t waits() {
  const std::lock_guard lock(Machine::mutex());
  return Machine::one().waits;
}
std::int64_t bytes_copied() {
  const std::lock_guard lock(Machine::mutex());
  return Machine::one().bytes_copied;
}
std::string last_message() {
  const std::lock_guard lock(Machine::mutex());
  return Machine::one().message;
}

}  // namespace cuda_on_cpu
