// SPDX-License-Identifier: MIT
// The cone of tangent rays of a sphere: its axis passes through the centre, unlike the outline's centroid.
// Unit rays d of the outline obey d . n = cos(a) with the axis n and the half angle a, sin(a) = radius /
// distance; m = n / cos(a) makes it linear, d . m = 1 (docs/math/color_to_depth.md, eq. 6 and 7).
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "base/camera.h"

namespace sdftrack::calibration {

struct Cone {
  Vec3d axis;
  double half_angle_rad;
  Vec2d center_px;  // image of the axis
  Eigen::Matrix2d covariance_px;
};

// Points of an outline, its outward unit normals in the image and its mean radius.
struct OutlineCurve {
  std::vector<Vec2d> at, normal;
  double radius_px = 0;
};

// NaN for a point that is not in front of the camera.
Vec2d pixel_of(const Camera& camera, Vec3d p_cam);
std::vector<Vec3d> unit_rays(const std::vector<Vec2d>& px, const Camera& camera);

// Robust fit to the unit rays of edges; empty if it fails.
std::optional<Cone> fit_cone(const std::vector<Vec3d>& rays, const Camera& camera);
// Distances of rays outside the cone, in pixels at the image centre.
std::vector<double> residuals_px(const Cone& cone, const std::vector<Vec3d>& rays, const Camera& camera);
OutlineCurve outline_of(const Cone& cone, const Camera& camera, int count);

}  // namespace sdftrack::calibration
