// SPDX-License-Identifier: MIT
// The size of an object beside its pose, from its outline in one colour image.
#pragma once

#include <optional>
#include <vector>

#include "energies/outline_energy.h"
#include "tracking/size/size_look.h"

namespace sdftrack::tracking {

// The same by the outline, at a distance that depth has to 1 %, with an offset that all lines share. rows: of
// the lines, at T_obj_cam; to_depth: from there to the pose by depth alone; noise: by which their sds are
// multiplied; shared_lines: that share one error.
std::optional<SizeLook> size_by_outline(const energies::OutlineLines& lines,
                                        const std::vector<energies::OutlineResidual>& rows, double noise,
                                        const Rigidd& T_obj_cam, const Vector6d& to_depth,
                                        double shared_lines);

}  // namespace sdftrack::tracking
