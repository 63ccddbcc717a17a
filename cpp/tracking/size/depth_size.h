// SPDX-License-Identifier: MIT
// The size of an object estimated with its pose, from the depth of one frame.
#pragma once

#include <optional>

#include "energies/pixel_set.h"
#include "tracking/size/size_look.h"

namespace sdftrack::tracking {

// Fits the pose, the log scale about the centre and the smooth modes of an error of sd systematic_m
// (systematic.h) to the residuals of an even subset of the pixels, at the hits found before. noise_m: of a
// measurement relative to its neighbours. No result where too few pixels show the surface.
std::optional<SizeLook> size_by_depth(const energies::PixelSet& pixels, float color_prior,
                                      const frame::Shape& shape, const Camera& camera,
                                      const Rigidd& T_obj_cam, double noise_m, double systematic_m);

// With the strain as an unknown too, at the best size: for another object of similar shape.
std::optional<StrainLook> strain_by_depth(const energies::PixelSet& pixels, float color_prior,
                                          const frame::Shape& shape, const Camera& camera,
                                          const Rigidd& T_obj_cam, double noise_m, double systematic_m);

}  // namespace sdftrack::tracking
