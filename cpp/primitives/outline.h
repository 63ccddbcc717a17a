// SPDX-License-Identifier: MIT
// The pixels next to an object's outline.
#pragma once

#include <cstdint>
#include <vector>

#include "primitives/view.h"

namespace sdftrack::primitives {

enum class Label : std::uint8_t { kOff = 0, kOn = 1, kUnknown = 2 };  // does a pixel show the object

// Pixels on the object and next to it, within `reach_px` of each other. A neighbour nearer than the object
// may hide it and is left out. Where the depth continues without a step (the table at its foot, an object
// that it touches) the solid only must not reach far into that surface. On a steep ramp of depth the ray
// counts as free up to a little before the measurement, since that may be a face of the object. Pixels
// without a measurement between the object and its background are marked (Sight::kLost), unless they are
// labelled as unknown. Any first part of the result is spread over the whole outline.
std::vector<OutlineRay> outline_rays(const frame::DepthFrame& frame, const Camera& camera,
                                     const std::uint8_t* labels, int reach_px);

// The measurements of the object, in an order of the same kind.
struct LabelledPoints {
  std::vector<Vec3d> points;
  std::vector<Pixel> pixels;
};
LabelledPoints labelled_points(const frame::DepthFrame& frame, const Camera& camera,
                               const std::uint8_t* labels);

// 0 .. n - 1, in an order of which any first part is spread over all.
std::vector<std::size_t> spread_order(std::size_t n);

}  // namespace sdftrack::primitives
