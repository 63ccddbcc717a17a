// SPDX-License-Identifier: MIT
// Checked sizes and points of primitives from Python.
#pragma once

#include <vector>

#include "array.h"
#include "primitives/solids.h"

namespace sdftrack::bindings {

primitives::PrimitiveSize checked_size(primitives::PrimitiveKind kind, const std::vector<double>& size);
const Vec3d* borrow_points(const py::array& points, std::size_t* n);

}  // namespace sdftrack::bindings
