// SPDX-License-Identifier: MIT
// Volumes and images from numpy, as views.
#pragma once

#include <array>

#include "array.h"
#include "base/views.h"

namespace sdftrack {

// float32 [z, y, x]; origin: object coordinates of voxel (0, 0, 0)'s centre, metres. The array stays the
// caller's.
SdfView volume_view(const py::array& values, double voxel_m, const std::array<double, 3>& origin);
// float32 (H, W) of the camera's size.
ImageView<float> image_view(const py::array& image, const char* name, const Camera& camera);
// uint8 (H, W) of the camera's size, or None.
const unsigned char* mask_view(const py::object& mask, const Camera& camera);

}  // namespace sdftrack
