// SPDX-License-Identifier: MIT
// The part of a mesh that a pixel shows, for CPU and GPU.
#pragma once

#include "base/pixel_ray.h"
#include "base/rigid.h"
#include "sdf/bvh_ray.h"
#include "sdf/mesh.h"

namespace sdftrack::render {

struct MeshHit {
  float depth_m = 0;  // z; 0: the ray misses
  Vec3f normal_cam{0, 0, 0};
  std::uint8_t rgb[3] = {0, 0, 0};
};

// A mesh in front of a camera.
struct MeshRays {
  sdf::MeshView mesh;
  sdf::BvhView bvh;
  const std::uint8_t* colors;  // 3 bytes a vertex, or nullptr
  LensRays lens;
  Rigidd T_cam_obj, T_obj_cam;

  HD MeshHit trace(int u, int v) const {
    // The ray has z = 1 in the camera frame, so its parameter is the depth itself.
    const Vec3d along = lens.at(u, v);
    const sdf::FirstHit first = sdf::first_hit(bvh, T_obj_cam.t, T_obj_cam.R * along);
    MeshHit out;
    if (first.face < 0) return out;
    const sdf::Face& f = mesh.faces[first.face];
    const Vec3d a = mesh.vertices[f.a], across = cross(mesh.vertices[f.b] - a, mesh.vertices[f.c] - a);
    Vec3d n = T_cam_obj.R * ((1 / norm(across)) * across);
    if (dot(n, along) > 0) n = -n;
    out.depth_m = float(first.hit.t), out.normal_cam = n.cast<float>();
    if (!colors) return out;
    for (int k = 0; k < 3; ++k) {
      const double c = first.hit.wa * colors[3 * f.a + k] + first.hit.wb * colors[3 * f.b + k] +
                       first.hit.wc * colors[3 * f.c + k];
      out.rgb[k] = static_cast<std::uint8_t>(smaller(larger(c + 0.5, 0.0), 255.0));
    }
    return out;
  }
};

}  // namespace sdftrack::render
