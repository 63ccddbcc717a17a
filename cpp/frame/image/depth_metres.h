// SPDX-License-Identifier: MIT
// Depth images of cameras and files: units become metres, holes of a registration are filled.
#pragma once

#include <cstddef>
#include <cstdint>

#include "base/views.h"

namespace sdftrack::frame {

// The nearest float to each distance, so that it does not depend on the unit of the file: units of sensors
// are 1 m / n, and a product with the rounded 1 / n would be up to 1 bit off.
void metres_of(const std::uint16_t* units, std::size_t count, double unit_m, float* depth_m);

// Whether the depth was warped into an image of more pixels, as by registration to a colour camera: lines of
// one or two pixels without a measurement, a few rows or columns apart, which are no borders of surfaces.
bool has_lattice(const ImageView<float>& depth_m);

// Fills holes of one or two pixels in a row, then in a column, linearly if their ends are of one surface.
void fill_lattice(int width, int height, float* depth_m);

}  // namespace sdftrack::frame
