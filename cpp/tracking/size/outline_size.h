// SPDX-License-Identifier: MIT
// The size of an object beside its pose, and its form, from its outline in one colour image.
#pragma once

#include <optional>
#include <vector>

#include "energies/outline_energy.h"
#include "tracking/size/size_look.h"

namespace sdftrack::tracking {

// Lines at T_obj_cam, whose distance depth has to 1 %; they share an offset.
struct OutlineRows {
  const std::vector<energies::OutlineResidual>& rows;
  double noise;  // by which the lines' sds are multiplied
  Rigidd T_obj_cam;
  Vector6d to_depth;    // from there to the pose by depth alone
  double shared_lines;  // that share one error
  Vec3d middle_obj;     // of the surface, which a strain leaves where it is
};

struct OutlineLook {
  SizeLook size;  // of an object that has the model's form
  StrainInformation form;
};

std::optional<OutlineLook> look_by_outline(const energies::OutlineLines& lines, const OutlineRows& given);

}  // namespace sdftrack::tracking
