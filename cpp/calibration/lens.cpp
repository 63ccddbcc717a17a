// SPDX-License-Identifier: MIT
#include "calibration/lens.h"

namespace sdftrack::calibration {

namespace {

constexpr std::size_t at(LensUnknown which) { return std::size_t(which); }

// The distorted coordinates of an ideal point, and their derivatives.
struct Distorted {
  Vec2d xy;
  double xx, xy_, yx, yy;  // d distorted x / d ideal x, d x / d y, ...
  Vec2d by_k1, by_k2;
};

Distorted distort_with_slopes(const Distortion& k, Vec2d ideal) {
  const double x = ideal.x, y = ideal.y, r2 = x * x + y * y;
  const double up = 1 + r2 * (k[0] + r2 * (k[1] + r2 * k[4])),
               up_slope = k[0] + r2 * (2 * k[1] + 3 * r2 * k[4]);
  const double down = 1 + r2 * (k[5] + r2 * (k[6] + r2 * k[7]));
  const double down_slope = k[5] + r2 * (2 * k[6] + 3 * r2 * k[7]);
  const double radial = up / down, slope = 2 * (up_slope - radial * down_slope) / down;  // by r2, times 2
  Distorted out;
  out.xy = brown_conrady(k.data(), ideal);
  out.xx = radial + slope * x * x + 2 * k[2] * y + 6 * k[3] * x;
  out.xy_ = slope * x * y + 2 * k[2] * x + 2 * k[3] * y;
  out.yx = out.xy_;
  out.yy = radial + slope * y * y + 6 * k[2] * y + 2 * k[3] * x;
  out.by_k1 = {x * r2 / down, y * r2 / down};
  out.by_k2 = {r2 * out.by_k1.x, r2 * out.by_k1.y};
  return out;
}

}  // namespace

double Lens::get(LensUnknown which) const {
  switch (which) {
    case LensUnknown::kFx:
      return camera.K.fx;
    case LensUnknown::kFy:
      return camera.K.fy;
    case LensUnknown::kCx:
      return camera.K.cx;
    case LensUnknown::kCy:
      return camera.K.cy;
    case LensUnknown::kSkew:
      return skew;
    case LensUnknown::kK1:
      return camera.distortion[0];
    case LensUnknown::kK2:
      return camera.distortion[1];
    case LensUnknown::kDepthScale:
      return depth_scale;
    case LensUnknown::kDepthOffset:
      return depth_offset_m;
  }
  return 0;
}

void Lens::set(LensUnknown which, double value) {
  switch (which) {
    case LensUnknown::kFx:
      camera.K.fx = value;
      break;
    case LensUnknown::kFy:
      camera.K.fy = value;
      break;
    case LensUnknown::kCx:
      camera.K.cx = value;
      break;
    case LensUnknown::kCy:
      camera.K.cy = value;
      break;
    case LensUnknown::kSkew:
      skew = value;
      break;
    case LensUnknown::kK1:
      camera.distortion[0] = value;
      break;
    case LensUnknown::kK2:
      camera.distortion[1] = value;
      break;
    case LensUnknown::kDepthScale:
      depth_scale = value;
      break;
    case LensUnknown::kDepthOffset:
      depth_offset_m = value;
      break;
  }
}

LensRay look_through(const Lens& lens, bool distorted, double u_px, double v_px) {
  const Intrinsics<double>& K = lens.camera.K;
  const double y = (v_px - K.cy) / K.fy, x = (u_px - K.cx - lens.skew * y) / K.fx;
  LensRay out;
  // First for the distorted coordinates.
  const double y_by_fy = -y / K.fy, y_by_cy = -1 / K.fy, x_by_y = -lens.skew / K.fx;
  out.dx[at(LensUnknown::kFx)] = -x / K.fx;
  out.dx[at(LensUnknown::kCx)] = -1 / K.fx;
  out.dx[at(LensUnknown::kSkew)] = -y / K.fx;
  out.dx[at(LensUnknown::kFy)] = x_by_y * y_by_fy, out.dy[at(LensUnknown::kFy)] = y_by_fy;
  out.dx[at(LensUnknown::kCy)] = x_by_y * y_by_cy, out.dy[at(LensUnknown::kCy)] = y_by_cy;
  out.ray = {x, y, 1};
  if (!distorted) return out;

  Vec2d ideal{x, y};
  Distorted d = distort_with_slopes(lens.camera.distortion, ideal);
  for (int step = 0; step < 20; ++step) {  // Newton's method: distort(ideal) = (x, y)
    const double ex = x - d.xy.x, ey = y - d.xy.y, det = d.xx * d.yy - d.xy_ * d.yx;
    ideal = {ideal.x + (d.yy * ex - d.xy_ * ey) / det, ideal.y + (d.xx * ey - d.yx * ex) / det};
    d = distort_with_slopes(lens.camera.distortion, ideal);
    if (ex * ex + ey * ey < 1e-20) break;
  }
  // distort(ideal, k) = given: d ideal = (d distort / d ideal)^-1 (d given - d distort / d k dk).
  const double det = d.xx * d.yy - d.xy_ * d.yx;
  out.dx[at(LensUnknown::kK1)] = -d.by_k1.x, out.dy[at(LensUnknown::kK1)] = -d.by_k1.y;
  out.dx[at(LensUnknown::kK2)] = -d.by_k2.x, out.dy[at(LensUnknown::kK2)] = -d.by_k2.y;
  for (std::size_t j = 0; j < kLensUnknowns; ++j) {
    const double gx = out.dx[j], gy = out.dy[j];
    out.dx[j] = (d.yy * gx - d.xy_ * gy) / det, out.dy[j] = (d.xx * gy - d.yx * gx) / det;
  }
  out.ray = {ideal.x, ideal.y, 1};
  return out;
}

}  // namespace sdftrack::calibration
