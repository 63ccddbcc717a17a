// SPDX-License-Identifier: MIT
#include "render/raycast_mesh.h"

#include <algorithm>
#include <cmath>

#include "base/parallel.h"
#include "render/pixel_box.h"

namespace sdftrack::render {

namespace {

constexpr int kRowsPerChunk = 8;

Vec3d face_normal(const sdf::Triangle& t) {
  const Vec3d n = cross(t.b - t.a, t.c - t.a);
  return (1 / norm(n)) * n;
}

void blend(const sdf::MeshView& mesh, const sdf::FirstHit& first, const std::uint8_t* colors,
           std::uint8_t* out) {
  const sdf::Face& f = mesh.faces[first.face];
  for (int k = 0; k < 3; ++k) {
    const double c = first.hit.wa * colors[3 * f.a + k] + first.hit.wb * colors[3 * f.b + k] +
                     first.hit.wc * colors[3 * f.c + k];
    out[k] = static_cast<std::uint8_t>(std::clamp(c + 0.5, 0.0, 255.0));
  }
}

}  // namespace

MeshImage raycast_mesh(const sdf::MeshView& mesh, const sdf::Bvh& bvh, const std::uint8_t* colors,
                       const Camera& camera, const Rigidd& T_cam_obj, int threads) {
  const std::size_t pixels = static_cast<std::size_t>(camera.width) * static_cast<std::size_t>(camera.height);
  MeshImage out{std::vector<float>(pixels), std::vector<float>(3 * pixels), {}};
  if (colors) out.colors.resize(3 * pixels);
  const PixelBox px = pixel_box(camera, T_cam_obj, bvh.box().low, bvh.box().high);
  if (px.empty()) return out;

  const Rigidd T_obj_cam = inverse(T_cam_obj);
  const auto rows = [&](std::size_t chunk) {
    const int begin = px.y0 + static_cast<int>(chunk) * kRowsPerChunk,
              end = std::min(px.y1, begin + kRowsPerChunk);
    for (int v = begin; v < end; ++v)
      for (int u = px.x0; u < px.x1; ++u) {
        // The ray has z = 1 in the camera frame, so its parameter is the depth itself.
        const sdf::FirstHit first = bvh.first_hit(T_obj_cam.t, T_obj_cam.R * camera.pixel_ray(u, v));
        if (first.face < 0) continue;
        const std::size_t i = static_cast<std::size_t>(v) * static_cast<std::size_t>(camera.width) +
                              static_cast<std::size_t>(u);
        out.depth_m[i] = static_cast<float>(first.hit.t);
        Vec3d n = T_cam_obj.R * face_normal(mesh.triangle(static_cast<std::size_t>(first.face)));
        if (dot(n, camera.pixel_ray(u, v)) > 0) n = -n;
        out.normals_cam[3 * i] = static_cast<float>(n.x);
        out.normals_cam[3 * i + 1] = static_cast<float>(n.y);
        out.normals_cam[3 * i + 2] = static_cast<float>(n.z);
        if (colors) blend(mesh, first, colors, &out.colors[3 * i]);
      }
  };
  parallel_for(static_cast<std::size_t>((px.y1 - px.y0 + kRowsPerChunk - 1) / kRowsPerChunk), threads, rows);
  return out;
}

}  // namespace sdftrack::render
