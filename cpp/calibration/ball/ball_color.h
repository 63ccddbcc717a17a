// SPDX-License-Identifier: MIT
// Colour model of the ball: a chromaticity histogram, from a given colour, or from moving pixels.
#pragma once

#include <array>
#include <vector>

#include "base/camera.h"
#include "calibration/ball/blobs.h"
#include "calibration/ball/rgb.h"

namespace sdftrack::calibration {

constexpr int kChromaBins =
    48;  // bins of r / (r + g + b) and of g / (r + g + b), which shading does not change
using ChromaTable = std::array<double, kChromaBins * kChromaBins>;

class BallColor {
 public:
  // RGB, 0..255; its brightness is ignored.
  explicit BallColor(Vec3d color);

  Vec3d color() const { return color_; }
  // The pixels that show the ball with a probability above 1/2.
  frame::PixelMask mask(const RgbImage& image) const;
  // Replaces the histogram by the posterior of pixels inside the outlines found with it, under a colour
  // camera or an estimate of it, against all others (equal priors).
  void learn(const std::vector<RgbImage>& images, const Camera& camera, std::uint64_t seed);

 private:
  Vec3d color_;
  ChromaTable ball_, posterior_;
};

// The most saturated colour among the pixels that change; std::invalid_argument if none does.
Vec3d moving_color(const std::vector<RgbImage>& images);

}  // namespace sdftrack::calibration
