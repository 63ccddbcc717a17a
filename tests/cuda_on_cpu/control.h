// SPDX-License-Identifier: MIT
// What tests set of the stand-in, and ask of it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

#include "cuda_runtime_api.h"

namespace cuda_on_cpu {

struct Settings {
  std::uint64_t seed = 1;
  int devices = 1;
  std::size_t bytes = std::size_t{1} << 30;  // of each device
  int compute_major = 9;                     // its capability
  bool late_pageable = false;                // pageable memory is read late, too
  double early = 0.2;                        // part of the calls after which some waiting work runs at once
};

// Waits for everything; what was allocated stays. Also ends what `fail_call` has asked for, and errors.
void reset(const Settings& settings);
Settings settings();

// The call after `calls` others that can fail gives `error`, and so do those after it, `times` in all: memory
// that has ended is asked for twice.
void fail_call(std::int64_t calls, cudaError_t error, int times = 1);
// Calls that can fail, since the last reset.
std::int64_t calls();
// The call that has failed on request; empty: none yet.
std::string failed_call();
// Bytes that are allocated on all devices.
std::size_t bytes_in_use();
// Kernels that have run since the last reset.
std::int64_t kernels_run();
// Times that the host has waited for a stream, an event or a device since then, and bytes copied to or from
// one.
std::int64_t waits();
std::int64_t bytes_copied();
// What the last failure of a kernel says.
std::string last_message();

}  // namespace cuda_on_cpu
