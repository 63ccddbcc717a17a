// SPDX-License-Identifier: MIT
// A known shape of Python for the reconstruction of an object.
#pragma once

#include <optional>
#include <tuple>

#include "array.h"
#include "reconstruction/beginning.h"

namespace sdftrack::bindings {

using PyKnownShape = std::tuple<py::array, double, std::array<double, 3>>;  // values, voxel (m), origin (m)

// The caller keeps the array.
std::optional<reconstruction::KnownShape> known_shape_from(const std::optional<PyKnownShape>& shape);

}  // namespace sdftrack::bindings
