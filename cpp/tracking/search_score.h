// SPDX-License-Identifier: MIT
// How well a pose explains a frame, as one number.
#pragma once

#include "tracking/search.h"

namespace sdftrack {

struct Evidence {
  Visibility seen;
  double explained = 1;     // share of the given readings that lie on a surface facing the camera
  bool all_object = false;  // the readings are all of the object: a mask
};

// 0..1: the share of unhidden surface that is seen where it should be, times what is explained.
double search_score(const Evidence& evidence);

// Share of readings within tolerance_m of a surface that faces the camera.
double explained_share(const SdfView& sdf, const std::vector<Vec3f>& readings_cam, const Rigidd& T_cam_obj,
                       double tolerance_m);

}  // namespace sdftrack
