// SPDX-License-Identifier: MIT
// A colour image as its 8-bit pixels.
#pragma once

#include <cstdint>

#include "base/views.h"

namespace sdftrack::calibration {

struct Rgb {
  std::uint8_t r, g, b;
};
using RgbImage = ImageView<Rgb>;

inline Vec3d as_vector(Rgb c) { return {double(c.r), double(c.g), double(c.b)}; }

}  // namespace sdftrack::calibration
