// SPDX-License-Identifier: MIT
// The volume of a session as Python's Reconstruction.
#pragma once

#include <memory>

#include "array.h"
#include "reconstruction/reconstruction.h"

namespace sdftrack::bindings {

py::object reconstruction_to_python(std::shared_ptr<reconstruction::Reconstruction> core, int threads);

}  // namespace sdftrack::bindings
