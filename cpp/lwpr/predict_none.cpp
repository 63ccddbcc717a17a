// SPDX-License-Identifier: MIT
// What a build without CUDA has in place of predict.cu: one error.
#include <stdexcept>

#include "lwpr/model.h"

namespace sdftrack::lwpr {

void LwprModel::predict_cuda(const double*, std::size_t, double*) const {
  throw std::runtime_error("this build has no CUDA path; build with SDFTRACK_CUDA=ON");
}

}  // namespace sdftrack::lwpr
