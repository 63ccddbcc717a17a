// SPDX-License-Identifier: MIT
// Maps from few pairs, without an initial guess.
#pragma once

#include <optional>
#include <vector>

#include "calibration/registration/ball_pair.h"
#include "calibration/registration/depth_to_color.h"

namespace sdftrack::calibration {

// The linear solution for M from at least 6 pairs, both sides normalised (Hartley).
DepthToColor linear_map(const std::vector<Vec3d>& p_cam, const std::vector<Vec2d>& color_px);

// The poses T_color_depth under which three points lie on three unit rays: up to four (Grunert's quartic, in
// the form of Haralick et al., 1994).
std::vector<Rigidd> poses_of_three(const Vec3d* p_cam, const Vec3d* rays);
// The pose from the first three of four pairs that maps the fourth best; empty if they determine none.
std::optional<DepthToColor> resection(const std::vector<Vec3d>& p_cam, const std::vector<Vec2d>& color_px,
                                      const Camera& color);

}  // namespace sdftrack::calibration
