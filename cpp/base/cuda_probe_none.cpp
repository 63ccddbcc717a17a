// SPDX-License-Identifier: MIT
// What a build without CUDA has in place of cuda_probe.cu: no device, and one error.
#include <stdexcept>

#include "base/cuda_probe.h"

namespace sdftrack {

bool cuda_built() { return false; }
bool cuda_available() { return false; }
std::string cuda_device_name() { return {}; }

void copy_from_device(const void*, std::size_t, void*) {
  throw std::runtime_error("this build has no CUDA path; build with SDFTRACK_CUDA=ON");
}

std::vector<float> scale_and_add_cuda(float, const std::vector<float>&, const std::vector<float>&) {
  throw std::runtime_error("this build has no CUDA path; build with SDFTRACK_CUDA=ON");
}

}  // namespace sdftrack
