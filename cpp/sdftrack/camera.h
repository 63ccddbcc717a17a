// SPDX-License-Identifier: MIT
// A depth camera and its frames. Pixel centres at integers, x right, y down, z forward; depth is the distance
// along z, not along the ray.
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <limits>

namespace sdftrack {

struct LensCamera {
  int width = 0, height = 0;
  double fx = 0, fy = 0, cx = 0, cy = 0;  // pixels
  // OpenCV's rational model: k1 k2 p1 p2 k3 k4 k5 k6.
  std::array<double, 8> distortion{};
};

using DepthCamera = LensCamera;

// A colour camera next to the depth camera, with images of its own size.
struct ColorCamera : LensCamera {
  // From the depth camera to this one, metres.
  Eigen::Isometry3d T_color_depth = Eigen::Isometry3d::Identity();
};

// One moment: images of the cameras' sizes, row by row, which belong to the caller. Either depth, or none.
struct Frame {
  const float* depth_m = nullptr;        // metres; 0 or NaN: no measurement
  const std::uint16_t* depth = nullptr;  // the same in steps of depth_unit_m; 0: no measurement
  double depth_unit_m = 0.001;
  // Three bytes for each pixel of the colour camera, without one for each depth pixel; none: depth alone.
  const std::uint8_t* rgb = nullptr;
  double time_s = std::numeric_limits<double>::quiet_NaN();  // not known
};

}  // namespace sdftrack
