// SPDX-License-Identifier: MIT
// Which GPUs are there, and do they compute what the CPU does? scale_and_add is the smallest kernel there is:
// it proves the compiler, the driver and the copies, and shows the pattern of every later kernel: one HD
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
// Numbers of the devices that answer and are new enough for the kernels. Never throws.
std::vector<int> cuda_devices();
// The capability that is new enough, as 10 * major + minor.
int cuda_least_capability();
// Its name; empty where there is no such device.
std::string cuda_device_name(int device);
// What its kernels were compiled from and run by: changes with the device, the driver and the build.
std::string cuda_fingerprint(int device);

// Waits for the device on which `device` lies, then copies from there. Without CUDA in the build:
// std::runtime_error.
void copy_from_device(const void* device, std::size_t bytes, void* host);

// a x + y, element by element. x and y must have the same length.
std::vector<float> scale_and_add_cpu(float a, const std::vector<float>& x, const std::vector<float>& y);
// The same on a GPU. Without CUDA in the build: std::runtime_error.
std::vector<float> scale_and_add_cuda(float a, const std::vector<float>& x, const std::vector<float>& y,
                                      int device);

}  // namespace sdftrack
