// SPDX-License-Identifier: MIT
// What form the seen part of a surface has that noise cannot be the cause of.
#pragma once

#include "frame/region.h"
#include "tracking/trust/covariance.h"

namespace sdftrack::tracking {

// Of a shape that is fused from the frames themselves: mean of J J^T (d phi / d increment of T_obj_cam) over
// the surface points that the frame reads, within tolerance_m, at T_cam_obj (centred), by smooth normals;
// turns are multiplied by half the shape's diameter over that of its seen part. Its bumps hold the pose that
// they were fused at, whatever the object does.
Matrix6d seen_form(const frame::DepthFrame& frame, const Camera& camera, const frame::Shape& shape,
                   const Rigidd& T_cam_obj, double tolerance_m);

// Root mean square slope of a form that is surely neither noise nor the grain of the voxels, a turn taken at
// half the diameter. Fused bodies of revolution have at most this, prisms of six sides 0.07 to 0.10, boxes
// and mugs more.
double least_form_slope(const frame::Shape& shape);

}  // namespace sdftrack::tracking
