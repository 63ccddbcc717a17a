// SPDX-License-Identifier: MIT
// How well a pose explains the depth image in a region, to compare the hypotheses of a start.
#pragma once

#include "tracking/start/connected_region.h"

namespace sdftrack::tracking {

// 0..1: the fraction of the unoccluded surface that is seen where the pose predicts it, times that of the
// region's measurements that lie on it. 0 where nothing of the surface is seen at `px` or beside it.
// T_cam_obj: of the centred object frame.
double score_pose(const frame::Shape& shape, const frame::DepthFrame& frame, const Camera& camera,
                  const Rigidd& T_cam_obj, const frame::PixelMask& region, Pixel px, int threads);

}  // namespace sdftrack::tracking
