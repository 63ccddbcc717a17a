// SPDX-License-Identifier: MIT
// Images and options of the contour tracker, from Python.
#pragma once

#include <optional>

#include "array.h"
#include "contour/tracker.h"

namespace sdftrack::bindings {

contour::RgbView color_view(const py::array& image);
// The flow of the part of the image with its corner at (x0, y0).
std::optional<contour::FlowView> flow_view(const std::optional<py::array>& flow, int x0, int y0,
                                           const contour::RgbView& image);
contour::ContourOptions options_from(const py::dict& given);
py::dict options_of(const contour::ContourOptions& options);

}  // namespace sdftrack::bindings
