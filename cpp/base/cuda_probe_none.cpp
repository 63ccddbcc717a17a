// SPDX-License-Identifier: MIT
// Replaces cuda_probe.cu in a build without CUDA: no devices; the other functions throw an error.
#include "base/cuda_probe.h"
#include "base/no_cuda.h"

namespace sdftrack {

bool cuda_built() { return false; }
std::vector<int> cuda_devices() { return {}; }
int cuda_least_capability() { return 0; }
std::string cuda_device_name(int) { return {}; }
std::string cuda_fingerprint(int) { return {}; }

void copy_from_device(const void*, std::size_t, void*) { no_cuda(); }

std::vector<float> scale_and_add_cuda(float, const std::vector<float>&, const std::vector<float>&, int) {
  no_cuda();
}

}  // namespace sdftrack
