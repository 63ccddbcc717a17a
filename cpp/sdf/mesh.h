// SPDX-License-Identifier: MIT
// Triangle meshes, borrowed: vertices in metres, object frame; faces counter-clockwise seen from outside.
#pragma once

#include <cstddef>
#include <cstdint>

#include "sdf/triangle.h"

namespace sdftrack::sdf {

struct Face {
  std::int32_t a, b, c;
};

struct MeshView {
  const Vec3d* vertices = nullptr;
  std::size_t vertex_count = 0;
  const Face* faces = nullptr;
  std::size_t face_count = 0;

  Triangle triangle(std::size_t i) const {
    const Face& f = faces[i];
    return {vertices[f.a], vertices[f.b], vertices[f.c]};
  }
};

}  // namespace sdftrack::sdf
