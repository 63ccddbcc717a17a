// SPDX-License-Identifier: MIT
// How well a pose explains a frame, as one number of 0..1, comparable between frames and objects.
#pragma once

#include "tracking/trust/outline.h"
#include "tracking/trust/trust.h"

namespace sdftrack::tracking {

// Share of readings that lie on a surface that faces the camera.
double explained_share(const SdfView& sdf, const std::vector<Vec3f>& readings_cam, const Rigidd& T_cam_obj,
                       double noise_m);

// The readings are known to be the object's: of its surface that nothing hides, the share that is read where
// it should be, times the share of the readings that are explained.
double score_of_mask(const Visibility& seen, double explained);

// They are not: then the evidence that a pose is judged by, and enough of the object must be seen.
double score_of_place(const Visibility& seen, const Outline& outline);

}  // namespace sdftrack::tracking
