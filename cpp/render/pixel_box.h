// SPDX-License-Identifier: MIT
// The rectangle of pixels that a box in space can cover: the only pixels a renderer has to visit.
#pragma once

#include "base/camera.h"
#include "base/rigid.h"

namespace sdftrack::render {

// Half open: x0 <= x < x1, y0 <= y < y1; empty when the box is behind the camera or outside the image.
struct PixelBox {
  int x0, y0, x1, y1;

  bool empty() const { return x0 >= x1 || y0 >= y1; }
};

PixelBox pixel_box(const Camera& camera, const Rigidd& T_cam_obj, Vec3d low_obj, Vec3d high_obj);

}  // namespace sdftrack::render
