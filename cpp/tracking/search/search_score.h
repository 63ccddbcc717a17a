// SPDX-License-Identifier: MIT
// How well a pose explains a frame, as one number in 0..1, comparable between frames and objects.
#pragma once

#include "tracking/trust/outline.h"
#include "tracking/trust/trust.h"

namespace sdftrack::tracking {

// Share of measurements that lie on a surface that faces the camera.
double explained_share(const SdfView& sdf, const std::vector<Vec3f>& readings_cam, const Rigidd& T_cam_obj,
                       double noise_m);

// For measurements known to be the object's: the share of the unoccluded surface that is measured where it
// should be, times the share of the measurements that are explained.
double score_of_mask(const Visibility& seen, double explained);

// For other measurements: the evidence that a pose is judged by; enough of the object must be visible.
double score_of_place(const Visibility& seen, const Outline& outline);

}  // namespace sdftrack::tracking
