// SPDX-License-Identifier: MIT
// Lists the GPUs and checks that they compute the same as the CPU. scale_and_add is a minimal kernel: it
// tests the compiler, the driver and the copies, and shows the pattern of every other kernel: one HD formula,
// one loop for the CPU, one kernel for the GPU.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "base/hd.h"

namespace sdftrack {

HD float scaled_sum(float a, float x, float y) { return a * x + y; }

// True in a library that was built with SDFTRACK_CUDA.
bool cuda_built();
// Numbers of the devices that respond and are new enough for the kernels. Never throws.
std::vector<int> cuda_devices();
// The least compute capability that the kernels need, as 10 * major + minor.
int cuda_least_capability();
// The device's name; empty if there is no such device.
std::string cuda_device_name(int device);
// Identifies the device, the driver and the build: changes with each of them.
std::string cuda_fingerprint(int device);

// Waits for the GPU that owns `device`, then copies. Throws std::runtime_error in a build without CUDA.
void copy_from_device(const void* device, std::size_t bytes, void* host);

// a x + y, element by element. x and y must have the same length.
std::vector<float> scale_and_add_cpu(float a, const std::vector<float>& x, const std::vector<float>& y);
// As scale_and_add_cpu, on a GPU. Throws std::runtime_error in a build without CUDA.
std::vector<float> scale_and_add_cuda(float a, const std::vector<float>& x, const std::vector<float>& y,
                                      int device);

}  // namespace sdftrack
