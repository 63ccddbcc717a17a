// SPDX-License-Identifier: MIT
// Whether an object ends where the pose says that it ends: what the camera reads just outside its silhouette.
#pragma once

#include "frame/region.h"
#include "frame/shape.h"
#include "tracking/trust/neighbors.h"
#include "tracking/trust/visibility.h"

namespace sdftrack::tracking {

// Directions around the silhouette, by what is read a few millimetres outside it. A flat face fits any wall
// and a small object fits into any larger one; that its surface also ends at the right place tells them
// apart.
struct Outline {
  int ends = 0;     // the reading lies behind: a step in depth
  int runs_on = 0;  // the reading goes on where the object ends: it touches something, or is part of it
  int unknown = 0;  // no reading, outside the image, or something stands in front
};

// A face in a wall, a small object in a larger one: all that is seen agrees, but hardly anything ends where
// it should.
constexpr double kMinEnds = 0.3;  // share of the directions that nothing hides
bool is_part_of_something(const Outline& outline, double min_ends = kMinEnds);

// A reading on the surface of one of `others` may hide where this object ends: unknown.
Outline compare_outline(const frame::DepthFrame& frame, const Camera& camera, const frame::Shape& shape,
                        const Rigidd& T_cam_obj, const DepthError& error, const Neighbors& others = {});

}  // namespace sdftrack::tracking
