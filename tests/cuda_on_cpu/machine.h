// SPDX-License-Identifier: MIT
// The devices, their streams and what waits in these. One lock for all: calls of several host threads take
// turns.
#pragma once

#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <random>
#include <string>
#include <vector>

#include "control.h"
#include "memory.h"

namespace cuda_on_cpu {

struct Mark {
  bool done = true;
};
struct Event {
  std::shared_ptr<Mark> mark = std::make_shared<Mark>();  // of the last record
};

// What waits: a copy, a kernel, a mark of an event or the wait for one.
struct Work {
  std::function<void()> run;
  std::shared_ptr<Mark> until = nullptr;  // not before it is done
  const char* kernel = nullptr;           // its name
};

struct Stream {
  int device = 0;
  bool destroyed = false;
  std::deque<Work> work;
};

class Machine {
 public:
  static Machine& one();  // locked by the caller
  static std::recursive_mutex& mutex();

  void reset(const Settings& settings);
  const Settings& settings() const { return settings_; }

  // The beginning of each call that can fail: why no call is taken, then an error that is due.
  cudaError_t refused();
  cudaError_t due(const char* call);
  cudaError_t failed(cudaError_t error);  // remembered until it is asked for
  cudaError_t last_error();               // and forgets it

  Stream* stream(cudaStream_t given);  // the current device's own for nullptr; nullptr: unknown
  void forget_streams();               // those that were destroyed and have come to their end
  void add(Stream* stream, Work work);
  // Runs waiting work in an order of its own until `done`; false: nothing can run any more.
  bool run_until(const std::function<bool()>& done);
  DeviceMemory* memory_of(const void* pointer, int* device = nullptr);

  std::vector<std::unique_ptr<DeviceMemory>> memory;
  std::vector<std::unique_ptr<Stream>> streams;  // the first ones are the devices' own
  std::map<cudaEvent_t, std::unique_ptr<Event>> events;
  std::map<const char*, std::size_t> pinned;
  std::int64_t calls = 0, kernels = 0, waits = 0, bytes_copied = 0;
  std::int64_t fail_after = -1;
  int fail_times = 0;
  cudaError_t fail_with = cudaSuccess;
  std::string failed_call, message;
  cudaError_t broken = cudaSuccess;  // after a kernel has failed every call says so
  std::mt19937_64 random;

 private:
  Machine();
  bool run_one();

  Settings settings_;
};

extern thread_local int current_device;

}  // namespace cuda_on_cpu

// The beginning of each function of the runtime that waits: an error is told when the wait is over.
#define ENTER_WAIT                              \
  const std::lock_guard lock(Machine::mutex()); \
  Machine& m = Machine::one();                  \
  if (const cudaError_t error = m.refused()) return error
// The same of each other function that can fail.
#define ENTER(name) \
  ENTER_WAIT;       \
  if (const cudaError_t error = m.due(name)) return error
