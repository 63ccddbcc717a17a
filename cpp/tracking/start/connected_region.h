// SPDX-License-Identifier: MIT
// What hangs together around a pixel of a depth image.
#pragma once

#include <string>
#include <vector>

#include "frame/image/point_image.h"

namespace sdftrack::tracking {

using frame::Pixel;

// An image of depths that a region grows in, from a window of a frame.
struct DepthWindow {
  int width = 0, height = 0;
  std::vector<float> depth_m;

  ImageView<float> view() const { return {depth_m.data(), width, height}; }
};
DepthWindow depth_window(const frame::DepthFrame& frame, const frame::Rect& window, int step = 1);

// Pixels of `free` connected to the seed over sides and corners, without a step in depth between neighbours
// larger than `step_m`. Empty if the seed is not free.
frame::PixelMask joined(const DepthWindow& window, const frame::PixelMask& free, Pixel seed, double step_m);

// The measurement at px, else the nearest one within 4 pixels that has others around it at its depth. Throws
// std::invalid_argument if there is none.
Pixel nearest_reading(const frame::DepthFrame& frame, Vec2d px);

constexpr int kMinRegionPixels = 20;

// Pixels connected to px without a depth discontinuity, within `reach_m` of it, and not on the frame's
// dominant plane unless px is. Throws std::invalid_argument without a measurement or with almost no pixels.
frame::PixelMask connected_region(const frame::DepthFrame& frame, const Camera& camera, Vec2d px,
                                  double reach_m);

// The sentence about a region with too few pixels.
std::string too_small_region(int pixels);

}  // namespace sdftrack::tracking
