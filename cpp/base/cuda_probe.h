// SPDX-License-Identifier: MIT
// Is there a GPU, and does it compute what the CPU does? scale_and_add is the smallest kernel there is: it
// proves the compiler, the driver and the copies, and shows the pattern of every later kernel: one HD
// formula, one loop for the CPU, one kernel for the GPU.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "base/hd.h"

namespace sdftrack {

HD float scaled_sum(float a, float x, float y) { return a * x + y; }

// True in a library that was built with SDFTRACK_CUDA.
bool cuda_built();
// True when, besides, a driver and at least one device answer. Never throws.
bool cuda_available();
// Name of the current device; empty without one.
std::string cuda_device_name();

// Waits for the device, then copies what lies at an address of it. Without CUDA in the build:
// std::runtime_error.
void copy_from_device(const void* device, std::size_t bytes, void* host);

// a x + y, element by element. x and y must have the same length.
std::vector<float> scale_and_add_cpu(float a, const std::vector<float>& x, const std::vector<float>& y);
// The same on the GPU. Without CUDA in the build: std::runtime_error.
std::vector<float> scale_and_add_cuda(float a, const std::vector<float>& x, const std::vector<float>& y);

}  // namespace sdftrack
