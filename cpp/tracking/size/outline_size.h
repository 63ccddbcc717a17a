// SPDX-License-Identifier: MIT
// The size and form of an object, estimated with its pose from the outline in one colour image.
#pragma once

#include <optional>
#include <vector>

#include "energies/outline_energy.h"
#include "tracking/size/size_look.h"

namespace sdftrack::tracking {

// Lines at T_obj_cam, whose distance is known from depth to 1 %; the lines share an offset.
struct OutlineRows {
  const std::vector<energies::OutlineResidual>& rows;
  double noise;  // factor on the lines' sds
  Rigidd T_obj_cam;
  Vector6d to_depth;    // from T_obj_cam to the pose by depth alone
  double shared_lines;  // number of lines that share one error
  Vec3d middle_obj;     // of the surface; a strain leaves it fixed
};

struct OutlineLook {
  SizeLook size;  // for an object that has the model's form
  StrainInformation form;
};

std::optional<OutlineLook> look_by_outline(const energies::OutlineLines& lines, const OutlineRows& given);

}  // namespace sdftrack::tracking
