// SPDX-License-Identifier: MIT
// Images and options of the contour tracker as Python gives them.
#pragma once

#include "array.h"
#include "contour/tracker.h"

namespace sdftrack::bindings {

contour::RgbView color_view(const py::array& image);
contour::ContourOptions options_from(const py::dict& given);
py::dict options_of(const contour::ContourOptions& options);

}  // namespace sdftrack::bindings
