// SPDX-License-Identifier: MIT
// Where points of an object's contour lie in the colour image, and whether they are visible there.
#pragma once

#include "energies/color_projection.h"
#include "frame/region.h"
#include "tracking/fit/contour_points.h"
#include "tracking/fit/outline_lines.h"

namespace sdftrack::tracking {

class OutlinePlaces {
 public:
  // At T_cam_obj (centred). Depth off the surface and more than search.in_front_m in front of it hides a
  // point, and so does a neighbour seen next to it. frame, camera, shape and view are kept by address.
  OutlinePlaces(const frame::DepthFrame& frame, const Camera& camera, const frame::Shape& shape,
                const Rigidd& T_cam_obj, const OutlineSearch& search, const energies::ColorProjection& view);

  // The point's pixel and outward normal; false where it is hidden or not in front of the camera.
  bool find(const ContourPoint& point, Vec2d* centre_px, Vec2d* normal) const;

 private:
  bool is_hidden(Vec3d p, Vec3d n) const;

  const frame::DepthFrame& frame_;
  const Camera& camera_;
  const frame::Shape& shape_;
  const Rigidd T_cam_obj_, T_obj_cam_;
  const energies::ColorProjection& view_;
  const double in_front_m_;
  const Neighbors* const beside_;
};

// The colour camera's centre in the depth camera's frame: the outline is the one seen by the colour camera.
Vec3d centre_of(const energies::ColorProjection& view);

}  // namespace sdftrack::tracking
