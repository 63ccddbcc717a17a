// SPDX-License-Identifier: MIT
// Replaces update.cu in a build without CUDA: one error.
#include "base/no_cuda.h"
#include "lwpr/units_on_device.h"

namespace sdftrack::lwpr {

std::unique_ptr<UnitsOnDevice> units_on_device(const FieldLayout&, const LwprOptions&, int) { no_cuda(); }

}  // namespace sdftrack::lwpr
