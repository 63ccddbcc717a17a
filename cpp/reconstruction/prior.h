// SPDX-License-Identifier: MIT
// The volume that a reconstruction begins with: its lattice, and what is guessed before anything is seen
// (docs/math/reconstruction.md, sections 5 and 7).
#pragma once

#include <optional>
#include <vector>

#include "reconstruction/beginning.h"

namespace sdftrack::reconstruction {

// A cube around the object of a first frame, or around the initial shape (nullptr: none). side_m: of the
// cube; none: 1.8 times the object's size.
sdf::Grid lattice_for(const Beginning& beginning, const KnownShape* initial, int voxels,
                      const std::optional<double>& side_m);

// Signed distances (m) of a shape at each voxel of another lattice, in the same frame.
std::vector<float> distances_at(const sdf::Grid& grid, const KnownShape& shape);

// Log odds (positive inside) of a ball around the origin. bounded: the first view bounds the guess laterally,
// so that it is wider; its depth is the mask's shorter side.
std::vector<float> ball_prior(const Ball& ball, double weight, const sdf::Grid& grid, bool bounded);

// Log odds of a given shape.
std::vector<float> shape_prior(const KnownShape& shape, double weight, const sdf::Grid& grid);

// Signed distances to the initial shape of the thesis' evolution: `initial`, or a ball of the mask's size.
// The thesis does not specify where its sphere lies. This one has the mean width of the mask, and its front
// touches the object's, because the steps of the first frame move the surface by only about ten voxels. The
// origin of the object frame is the centre of `ball`.
std::vector<float> printed_shape(const Ball& ball, const KnownShape* initial, const sdf::Grid& grid);

// Log odds of inside to outside from the first shape (thesis Eqs. 4.32 to 4.34).
std::vector<float> printed_prior(const float* shape_m, std::size_t count, double voxel_m);

}  // namespace sdftrack::reconstruction
