// SPDX-License-Identifier: MIT
#include "appearance/color_map.h"

#include <algorithm>

namespace sdftrack::appearance {

namespace {

Mat3d camera_matrix(const Intrinsics<double>& K) { return {{K.fx, 0, K.cx}, {0, K.fy, K.cy}, {0, 0, 1}}; }

Mat3d inverse_camera_matrix(const Intrinsics<double>& K) {
  return {{1 / K.fx, 0, -K.cx / K.fx}, {0, 1 / K.fy, -K.cy / K.fy}, {0, 0, 1}};
}

// Squared radius of the farthest corner of the image, with a margin.
float lens_reach2(const Camera& camera) {
  double reach2 = 0;
  for (const double u : {-0.5, camera.width - 0.5})
    for (const double v : {-0.5, camera.height - 0.5}) {
      const Vec3d r = camera.pixel_ray(u, v);
      reach2 = std::max(reach2, r.x * r.x + r.y * r.y);
    }
  return float(1.1 * reach2);
}

}  // namespace

ColorMap aligned_map(int width, int height) {
  ColorMap map;
  map.width = width, map.height = height;
  return map;
}

ColorMap rigid_map(const Camera& depth, const Camera& color, const Rigidd& T_color_depth) {
  ColorMap map;
  map.width = color.width, map.height = color.height;
  map.aligned = map.raw_pixel = false;
  map.lens = color.distorted();
  const Mat3d back = T_color_depth.R * inverse_camera_matrix(depth.K);
  const Mat3d K = map.lens ? Mat3d::identity() : camera_matrix(color.K);
  map.P = (K * back).cast<float>();
  map.q = (K * T_color_depth.t).cast<float>();
  if (map.lens) {
    map.K = color.K.cast<float>();
    for (int i = 0; i < 8; ++i) map.distortion[i] = float(color.distortion[i]);
    map.reach2 = lens_reach2(color);
  }
  return map;
}

ColorMap projective_map(const Mat3d& P, Vec3d q, int width, int height) {
  ColorMap map;
  map.width = width, map.height = height;
  map.aligned = false;
  // (P, q) is known up to its sign: a point far along the middle of the view must be in front.
  const double sign = dot(P.r2, Vec3d{width / 2.0, height / 2.0, 1.0}) < 0 ? -1.0 : 1.0;
  map.P = (sign * P).cast<float>();
  map.q = (sign * q).cast<float>();
  return map;
}

}  // namespace sdftrack::appearance
