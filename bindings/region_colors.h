// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <vector>

#include "tracking/fit/fit.h"

namespace sdftrack::bindings {

// The colour of each measurement of a region, 0 where there is none; rows of `rect`, 3 bytes per pixel.
void fetch_colors(const frame::DepthFrame& frame, const frame::Rect& rect, std::vector<std::uint8_t>* rgb);

}  // namespace sdftrack::bindings
