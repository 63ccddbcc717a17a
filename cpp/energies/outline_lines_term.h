// SPDX-License-Identifier: MIT
// The residual of one line across the outline, as plain numbers for the CPU and for kernels.
#pragma once

#include "energies/color_projection.h"

namespace sdftrack::energies {

// A surface point on the outline, and where along the image normal the colours indicate the outline.
struct OutlineLine {
  Vec3d p_obj;
  Vec2d centre_px, normal;  // centre: p_obj at the pose of the line's creation; normal: outwards, unit length
  double offset_px, sd_px;  // offset of the true outline from centre_px along normal
};

constexpr int kOffsetSteps = 20;

// A Newton step for the common offset. Its curvature is at least two thirds of that of the reweighted
// squares: their own step always lowers the cost, and so does one that is less than twice as long; twice can
// jump there and back.
struct CommonOffset {
  double slope, steep, curved;

  // off_px: a line's residual minus the common offset; precision: 1 / sd^2.
  HD void add(double off_px, double precision) {
    const double half = 0.5 * precision * off_px * off_px, weight = precision / (1 + half);
    slope -= weight * off_px;
    steep += weight;
    curved += weight * (1 - half) / (1 + half);
  }
  HD double step() const {
    const double least = 2.0 / 3 * steep;
    return slope / (curved < least ? least : curved);
  }
  HD bool settled() const { return abs(step()) < 1e-9; }  // pixels
};

struct OutlineLinesTerm {
  ColorProjection view{};
  double inv_noise = 1;
  double hold = 0;  // L / s^2; 0: no common offset
  const OutlineLine* lines = nullptr;
  int count = 0;  // 0: this term is left out

  HD double per_sd(const OutlineLine& line) const { return inv_noise / line.sd_px; }
  // Distance of the line's point from the outline that the colours indicate, and the derivative of its pixel
  // by p_cam. False behind the camera.
  HD bool find(const OutlineLine& line, const Rigidd& T_cam_obj, double* off_px, PixelJacobian* J) const {
    Vec2d u;
    if (!view.place(T_cam_obj * line.p_obj, &u, J)) return false;
    const double off = line.normal.x * (u.x - line.centre_px.x) + line.normal.y * (u.y - line.centre_px.y);
    *off_px = off - line.offset_px;
    return true;
  }
  HD CommonOffset begin_offset(double b) const { return {hold * b, hold, hold}; }
  // p_cam = T^-1 X, and T <- increment(v, w) T moves it by -R^T (v + w x X): (-a, a x X) with a = R J^T n.
  HD static void row(const OutlineLine& line, const Rigidd& T_obj_cam, const PixelJacobian& J, double per_sd,
                     double* out) {
    const Vec3d a = per_sd * (T_obj_cam.R * (line.normal.x * J.u + line.normal.y * J.v));
    const Vec3d turn = cross(a, line.p_obj);
    out[0] = -a.x, out[1] = -a.y, out[2] = -a.z, out[3] = turn.x, out[4] = turn.y, out[5] = turn.z;
  }
};

}  // namespace sdftrack::energies
