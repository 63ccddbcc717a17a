// SPDX-License-Identifier: MIT
// Motions that leave a surface unchanged: the rotations of a body of revolution (slippable motions, Gelfand
// and Guibas, "Shape segmentation using local slippage analysis", 2004).
#pragma once

#include <array>
#include <vector>

#include "base/rigid.h"

namespace sdftrack::frame {

// Moments of surface points about the origin.
struct Moments {
  Vec3d mean{0, 0, 0};
  Mat3d square{};  // mean of p p^T
};
Moments moments_of(const std::vector<Vec3f>& points);

// Means of the normals that face the same side around every kSmoothEvery-th point: noise on a surface is of
// finer scale. Two such lists, each from half of the points: their noise is independent.
constexpr std::size_t kSmoothEvery = 2;
std::array<std::vector<Vec3f>, 2> smooth_normals(const std::vector<Vec3f>& points,
                                                 const std::vector<Vec3f>& normals, double radius_m);

// (v, w half_m) of unit length, orthogonal, that move surface points along their normals by no more than
// voxelisation does for a perfect body of revolution. At most three.
std::vector<std::array<double, 6>> slips_of(const std::vector<Vec3f>& points,
                                            const std::vector<Vec3f>& normals, double half_m);

}  // namespace sdftrack::frame
