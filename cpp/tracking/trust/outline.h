// SPDX-License-Identifier: MIT
// Whether an object ends where its pose predicts: depth just outside its silhouette.
#pragma once

#include "frame/region.h"
#include "frame/shape.h"
#include "tracking/trust/neighbors.h"
#include "tracking/trust/visibility.h"

namespace sdftrack::tracking {

// Counts of directions around the silhouette, by the depth a few millimetres outside it: a flat face fits any
// wall; only a surface that ends at the right place tells them apart.
struct Outline {
  int ends = 0;     // the measurement lies behind: a step in depth
  int runs_on = 0;  // the surface continues where the object ends: it touches something, or is part of it
  int unknown = 0;  // no measurement, outside the image, or something stands in front
};

// A face in a wall, a small object in a larger one: all agrees, but hardly anything ends where it should.
constexpr double kMinEnds = 0.3;  // share of the unoccluded directions
bool is_part_of_something(const Outline& outline, double min_ends = kMinEnds);

// Unknown: a measurement on the surface of one of `others`, which may hide where this object ends.
Outline compare_outline(const frame::DepthFrame& frame, const Camera& camera, const frame::Shape& shape,
                        const Rigidd& T_cam_obj, const DepthError& error, const Neighbors& others = {});

}  // namespace sdftrack::tracking
