// SPDX-License-Identifier: MIT
// Replaces predict.cu in a build without CUDA: one error.
#include "base/no_cuda.h"
#include "lwpr/model.h"

namespace sdftrack::lwpr {

void LwprModel::predict_cuda(const double*, std::size_t, int, double*, std::size_t) const { no_cuda(); }
DeviceArray LwprModel::predict_there(const ForeignArray&, std::size_t, int) const { no_cuda(); }

}  // namespace sdftrack::lwpr
