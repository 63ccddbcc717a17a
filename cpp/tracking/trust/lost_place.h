// SPDX-License-Identifier: MIT
// Why there is no reading near a pose, where the pose itself says so.
#pragma once

#include "base/camera.h"
#include "base/rigid.h"
#include "base/views.h"
#include "frame/shape.h"
#include "tracking/trust/reason.h"

namespace sdftrack::tracking {

// The reason of an object that is lost at a pose (centred frame): `reason`, or, where that is only that
// nothing was seen there, that no camera could see it there. depth_m.data: nullptr without a depth image.
Reason lost_at(const Rigidd& T_cam_obj, const frame::Shape& shape, const Camera& camera,
               const ImageView<float>& depth_m, Reason reason);

}  // namespace sdftrack::tracking
