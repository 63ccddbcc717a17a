// SPDX-License-Identifier: MIT
#pragma once

#include "appearance/color_map.h"
#include "array.h"

namespace sdftrack::bindings {

// Borrows a colour image (H, W, 3) uint8 of the map's size; rgb is nullptr if `color` is None.
appearance::ColorImage color_view(const py::object& color, const py::object& map);

}  // namespace sdftrack::bindings
