// SPDX-License-Identifier: MIT
// Sub-pixel detection of a coloured ball's outline in a colour image.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "calibration/ball/blobs.h"
#include "calibration/ball/cone.h"
#include "calibration/ball/rgb.h"

namespace sdftrack::calibration {

constexpr double kMinRadius_px = 5;

// Edges of a ball's outline consistent with a cone, their rms and mean radius, and the share of the
// circumference that they cover.
struct Outline {
  std::vector<Vec2d> edges_px;
  double rms_px, radius_px, arc;

  // Axis and opening of the cone of tangent rays under a camera.
  std::optional<Cone> cone(const Camera& camera) const;
};

// Outlines of round regions of a mask of the ball's colour, the best first. The camera, or an estimate of it,
// is only used to predict the outline around which edges are searched. `most`: blobs examined.
std::vector<Outline> find_outlines(const RgbImage& image, const frame::PixelMask& mask, const Camera& camera,
                                   std::uint64_t seed, std::size_t most);

// Radius of a disc with the largest blob's area if the blob is too small to be fitted; else 0.
double too_small_radius_px(const frame::PixelMask& mask);

}  // namespace sdftrack::calibration
