// SPDX-License-Identifier: MIT
// Objects known to be near the current one: their measurements do not contradict it.
#pragma once

#include <vector>

#include "energies/field.h"
#include "frame/shape.h"

namespace sdftrack::tracking {

using Neighbors = std::vector<energies::SingleObject<float>>;

inline energies::SingleObject<float> field_of(const frame::Shape& shape, const Rigidd& T_cam_obj) {
  return {shape.sdf, inverse(T_cam_obj).cast<float>()};
}

bool on_one_of(const Neighbors& others, Vec3d p_cam, double tolerance_m);
// Penetration of the deepest of a shape's points into one of them; 0: outside all.
double depth_in(const Neighbors& others, const frame::Shape& shape, const Rigidd& T_cam_obj);
// The least field of another object at a shape's points: the gap between them.
double gap_between(const energies::SingleObject<float>& other, const frame::Shape& shape,
                   const Rigidd& T_cam_obj);
// Whether its middle lies deep in another object: the two are in one place.
bool middle_in(const energies::SingleObject<float>& other, const frame::Shape& shape,
               const Rigidd& T_cam_obj);
// Whether it penetrates one of them more deeply than errors of the poses explain.
bool stands_in(const Neighbors& others, const frame::Shape& shape, const Rigidd& T_cam_obj);

}  // namespace sdftrack::tracking
