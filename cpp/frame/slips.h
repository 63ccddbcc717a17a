// SPDX-License-Identifier: MIT
// Motions that leave a surface as it is: the turns of a body of revolution (slippable motions, Gelfand and
// Guibas, "Shape segmentation using local slippage analysis", 2004).
#pragma once

#include <array>
#include <vector>

#include "base/rigid.h"

namespace sdftrack::frame {

// Of surface points about the origin.
struct Moments {
  Vec3d mean{0, 0, 0};
  Mat3d square{};  // mean of p p^T
};
Moments moments_of(const std::vector<Vec3f>& points);

// Means of the normals around every kSmoothEvery-th point, of those that look to the same side: what noise
// has made of a surface is finer than that. Two of them, each of half the points: what they have in common is
// less noise.
constexpr std::size_t kSmoothEvery = 2;
std::array<std::vector<Vec3f>, 2> smooth_normals(const std::vector<Vec3f>& points,
                                                 const std::vector<Vec3f>& normals, double radius_m);

// (v, w half_m) of unit length, orthogonal, along which the surface points move along the normals by less
// than the grain of a voxel volume makes of a perfect body of revolution. At most three.
std::vector<std::array<double, 6>> slips_of(const std::vector<Vec3f>& points,
                                            const std::vector<Vec3f>& normals, double half_m);

}  // namespace sdftrack::frame
