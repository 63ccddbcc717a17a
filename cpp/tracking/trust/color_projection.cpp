// SPDX-License-Identifier: MIT
#include "tracking/trust/color_projection.h"

#include <algorithm>

namespace sdftrack::tracking {

namespace {

Mat3d camera_matrix(const Intrinsics<double>& K) { return {{K.fx, 0, K.cx}, {0, K.fy, K.cy}, {0, 0, 1}}; }

Mat3d cast(const Mat3<float>& M) { return {M.r0.cast<double>(), M.r1.cast<double>(), M.r2.cast<double>()}; }

}  // namespace

energies::ColorProjection color_projection(const Camera& camera, const appearance::ColorMap& map) {
  energies::ColorProjection view;
  view.width = map.width, view.height = map.height;
  if (map.aligned) {
    if (camera.distorted()) {
      view.has_lens = true, view.K = camera.K;
      std::copy(camera.distortion.begin(), camera.distortion.end(), view.lens);
    } else {
      view.A = camera_matrix(camera.K);
    }
    return view;
  }
  view.has_first = map.raw_pixel && camera.distorted();
  std::copy(camera.distortion.begin(), camera.distortion.end(), view.first);
  view.A = cast(map.P) * camera_matrix(camera.K);
  view.q = map.q.cast<double>();
  view.has_lens = map.lens;
  view.K = map.K.cast<double>();
  std::transform(map.distortion, map.distortion + 8, view.lens, [](float k) { return double(k); });
  return view;
}

}  // namespace sdftrack::tracking
