// SPDX-License-Identifier: MIT
// Symmetries of shapes from Python.
#pragma once

#include "array.h"
#include "frame/symmetry.h"

namespace sdftrack::bindings {

// discrete: (n, 4, 4) without the identity; axes: (m, 2, 3), the direction and a point of each.
frame::Symmetry symmetry_from(const py::array& discrete, const py::array& axes);

}  // namespace sdftrack::bindings
