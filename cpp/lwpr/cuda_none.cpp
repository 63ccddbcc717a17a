// SPDX-License-Identifier: MIT
// In a build without CUDA, in place of the .cu files of this folder: the error of no_cuda.h.
#include "base/no_cuda.h"
#include "lwpr/model.h"
#include "lwpr/units_on_device.h"

namespace sdftrack::lwpr {

std::unique_ptr<UnitsOnDevice> units_on_device(const FieldLayout&, const LwprOptions&, int) { no_cuda(); }

void LwprModel::predict_cuda(const double*, std::size_t, int, double*, std::size_t) const { no_cuda(); }
DeviceArray LwprModel::predict_there(const ForeignArray&, std::size_t, int) const { no_cuda(); }

}  // namespace sdftrack::lwpr
