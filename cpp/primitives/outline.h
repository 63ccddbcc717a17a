// SPDX-License-Identifier: MIT
// The pixels beside the edge of an object's picture.
#pragma once

#include <cstdint>
#include <vector>

#include "primitives/view.h"

namespace sdftrack::primitives {

enum class Label : std::uint8_t { kOff = 0, kOn = 1, kUnknown = 2 };  // is the object seen in a pixel

// Pixels on the object and beside it, within `reach_px` of one another. A reading nearer than the object
// beside it hides it, and says nothing. Where the depth goes on without a
// step (the table at its foot, a neighbour that it touches) the solid may not reach far into what is seen,
// and that is all; in front of a reading on a steep ramp of depth the ray is free up to a little before it,
// for it may be a face of the object itself. Pixels without a reading between the object and what is behind
// it are told apart (Sight::kLost). In an order of which any first part is spread over all.
std::vector<OutlineRay> outline_rays(const frame::DepthFrame& frame, const Camera& camera,
                                     const std::uint8_t* labels, int reach_px);

// The readings of the object, in such an order too.
struct LabelledPoints {
  std::vector<Vec3d> points;
  std::vector<Pixel> pixels;
};
LabelledPoints labelled_points(const frame::DepthFrame& frame, const Camera& camera,
                               const std::uint8_t* labels);

// 0 .. n - 1, any first part of them spread over all.
std::vector<std::size_t> spread_order(std::size_t n);

}  // namespace sdftrack::primitives
