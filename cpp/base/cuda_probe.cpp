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

}  // namespace sdftrack
