// SPDX-License-Identifier: MIT
// Why there is no measurement near a pose, where the pose itself explains it.
#pragma once

#include "base/camera.h"
#include "base/rigid.h"
#include "base/views.h"
#include "frame/shape.h"
#include "tracking/trust/reason.h"

namespace sdftrack::tracking {

// The reason of an object lost at a pose (centred frame): `reason`, unless that only states that nothing was
// seen where no camera could see the object. depth_m.data: nullptr without a depth image.
Reason lost_at(const Rigidd& T_cam_obj, const frame::Shape& shape, const Camera& camera,
               const ImageView<float>& depth_m, Reason reason);

}  // namespace sdftrack::tracking
