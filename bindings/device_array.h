// SPDX-License-Identifier: MIT
#pragma once

#include <memory>
#include <vector>

#include "array.h"
#include "base/device_array.h"

namespace sdftrack::bindings {

struct OnDevice {
  DeviceArray memory;
  py::dtype dtype;
  std::vector<py::ssize_t> shape;
};

}  // namespace sdftrack::bindings
