// SPDX-License-Identifier: MIT
// Projection of a point in front of the depth camera into the colour image, with its derivative.
#pragma once

#include "base/camera.h"
#include "base/rigid.h"

namespace sdftrack::energies {

// d pixel / d p_cam: the rows of u and of v.
struct PixelJacobian {
  Vec3d u, v;
};

// y = A p_cam + q; the pixel is (y.x / y.z, y.y / y.z), and with a lens K brown_conrady(of that). `first` is
// a lens of the depth camera that is not part of the map from its stored pixels; it acts on p_cam before A.
struct ColorProjection {
  Mat3d A = Mat3d::identity();
  Vec3d q{0, 0, 0};
  bool has_first = false, has_lens = false;
  double first[8] = {}, lens[8] = {};  // as Distortion
  Intrinsics<double> K{1, 1, 0, 0};
  int width = 0, height = 0;

  // False behind the camera.
  HD bool place(Vec3d p_cam, Vec2d* pixel) const {
    if (has_first) {
      if (!(p_cam.z > 0)) return false;
      const Vec2d bent = brown_conrady(first, Vec2d{p_cam.x / p_cam.z, p_cam.y / p_cam.z});
      p_cam = p_cam.z * Vec3d{bent.x, bent.y, 1};
    }
    const Vec3d y = A * p_cam + q;
    if (!(y.z > 0)) return false;
    *pixel = {y.x / y.z, y.y / y.z};
    if (has_lens) {
      const Vec2d bent = brown_conrady(lens, *pixel);
      *pixel = {K.fx * bent.x + K.cx, K.fy * bent.y + K.cy};
    }
    return true;
  }

  // The pixel with its derivative: exact without a lens, by central differences of a micrometre with one.
  HD bool place(Vec3d p_cam, Vec2d* pixel, PixelJacobian* J) const {
    if (!place(p_cam, pixel)) return false;
    if (!has_first && !has_lens) {
      const Vec3d y = A * p_cam + q;
      const double inv = 1 / y.z;
      J->u = inv * (A.r0 - (y.x * inv) * A.r2);
      J->v = inv * (A.r1 - (y.y * inv) * A.r2);
      return true;
    }
    constexpr double kStep_m = 1e-6;
    double* const du[3] = {&J->u.x, &J->u.y, &J->u.z};
    double* const dv[3] = {&J->v.x, &J->v.y, &J->v.z};
    const Vec3d axes[3] = {{kStep_m, 0, 0}, {0, kStep_m, 0}, {0, 0, kStep_m}};
    for (int k = 0; k < 3; ++k) {
      Vec2d more, less;
      if (!place(p_cam + axes[k], &more) || !place(p_cam - axes[k], &less)) return false;
      *du[k] = (more.x - less.x) / (2 * kStep_m);
      *dv[k] = (more.y - less.y) / (2 * kStep_m);
    }
    return true;
  }
};

}  // namespace sdftrack::energies
