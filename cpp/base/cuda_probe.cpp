// SPDX-License-Identifier: MIT
#include "base/cuda_probe.h"

#include <stdexcept>

namespace sdftrack {

std::vector<float> scale_and_add_cpu(float a, const std::vector<float>& x, const std::vector<float>& y) {
  if (x.size() != y.size())
    throw std::invalid_argument("scale_and_add: expected x and y of one length, got " +
                                std::to_string(x.size()) + " and " + std::to_string(y.size()));
  std::vector<float> out(x.size());
  for (std::size_t i = 0; i < x.size(); ++i) out[i] = scaled_sum(a, x[i], y[i]);
  return out;
}

#ifndef SDFTRACK_WITH_CUDA  // else these are in cuda_probe.cu
bool cuda_built() { return false; }
bool cuda_available() { return false; }
std::string cuda_device_name() { return {}; }

void copy_from_device(const void*, std::size_t, void*) {
  throw std::runtime_error("this build has no CUDA path; build with SDFTRACK_CUDA=ON");
}

std::vector<float> scale_and_add_cuda(float, const std::vector<float>&, const std::vector<float>&) {
  throw std::runtime_error("this build has no CUDA path; build with SDFTRACK_CUDA=ON");
}
#endif

}  // namespace sdftrack
