// SPDX-License-Identifier: MIT
// Maps a depth pixel to the colour pixel that shows the same point.
#pragma once

#include "base/camera.h"
#include "base/rigid.h"
#include "base/to_int.h"

namespace sdftrack::appearance {

// y = P (u Z, v Z, Z) + q for the depth pixel (u, v) with the measurement Z (m); the colour pixel is
// (y.x / y.z, y.y / y.z), thesis Eq. 3.25. One formula for every rig: with T_color_depth, P = K_c R K_d^-1
// and q = K_c t; aligned images have P = I, q = 0. If the colour camera has a lens, P and q lead to its
// normalised coordinates, and the lens is applied after the division. docs/math/color.md, section 1.
struct ColorMap {
  Mat3<float> P = Mat3<float>::identity();
  Vec3f q{0, 0, 0};
  int width = 0, height = 0;  // of the colour image
  bool aligned = true;        // the same pixel: no point can be hidden from the colour camera alone
  bool raw_pixel = true;      // (u, v) as stored in the depth image; false: with its lens removed
  bool lens = false;
  Intrinsics<float> K{1, 1, 0, 0};
  float distortion[8] = {};
  float reach2 = 0;  // squared normalised radius beyond which the lens polynomial may turn back

  // Place and depth (the colour camera's z times a constant of the rig) in the colour image; false outside.
  HD bool place(Vec2f u_px, float depth_m, Vec2f* where, float* depth) const {
    const Vec3f at = P * Vec3f{depth_m * u_px.x, depth_m * u_px.y, depth_m} + q;
    if (!(at.z > 0)) return false;
    Vec2f c{at.x / at.z, at.y / at.z};
    if (lens) {
      if (!(c.x * c.x + c.y * c.y < reach2)) return false;
      c = brown_conrady(distortion, c);
      c = {K.fx * c.x + K.cx, K.fy * c.y + K.cy};
    }
    // Tested before the conversion to int, which is undefined for a number out of range.
    if (!(c.x > -0.5f && c.y > -0.5f && c.x < float(width) - 0.5f && c.y < float(height) - 0.5f))
      return false;
    *where = c, *depth = at.z;
    return true;
  }
  // The pixel nearest to the place.
  HD bool find(Vec2f u_px, float depth_m, int* x, int* y, float* depth) const {
    Vec2f c;
    if (!place(u_px, depth_m, &c, depth)) return false;
    *x = to_int(c.x + 0.5f), *y = to_int(c.y + 0.5f);
    return true;
  }
};

ColorMap aligned_map(int width, int height);
ColorMap rigid_map(const Camera& depth, const Camera& color, const Rigidd& T_color_depth);
// (P, q) as calibrated; the sign is chosen so that points in front have y.z > 0.
ColorMap projective_map(const Mat3d& P, Vec3d q, int width, int height);

// A colour image and the map to its pixels.
struct ColorImage {
  const unsigned char* rgb = nullptr;  // row-major, 3 bytes per pixel
  ColorMap map;

  HD const unsigned char* at(int x, int y) const { return rgb + 3 * (std::size_t(y) * map.width + x); }
};

}  // namespace sdftrack::appearance
