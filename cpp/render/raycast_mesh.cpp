// SPDX-License-Identifier: MIT
#include "render/raycast_mesh.h"

#include <algorithm>

#include "base/interrupt.h"
#include "base/parallel.h"
#include "render/pixel_box.h"

namespace sdftrack::render {

namespace {

constexpr int kRowsPerChunk = 8;

}  // namespace

MeshImage::MeshImage(const Camera& camera, bool colored) {
  const std::size_t pixels = std::size_t(camera.width) * camera.height;
  depth_m.resize(pixels), normals_cam.resize(3 * pixels);
  if (colored) colors.resize(3 * pixels);
}

void MeshImage::put(const MeshHit& hit, std::size_t pixel) {
  depth_m[pixel] = hit.depth_m;
  normals_cam[3 * pixel] = hit.normal_cam.x;
  normals_cam[3 * pixel + 1] = hit.normal_cam.y;
  normals_cam[3 * pixel + 2] = hit.normal_cam.z;
  if (!colors.empty()) std::copy_n(hit.rgb, 3, &colors[3 * pixel]);
}

MeshImage raycast_mesh(const sdf::MeshView& mesh, const sdf::Bvh& bvh, const std::uint8_t* colors,
                       const Camera& camera, const Rigidd& T_cam_obj, int threads) {
  MeshImage out(camera, colors != nullptr);
  const PixelBox px = pixel_box(camera, T_cam_obj, bvh.box().low, bvh.box().high);
  if (px.empty()) return out;

  const MeshRays rays{mesh, bvh.view(), colors, LensRays(camera), T_cam_obj, inverse(T_cam_obj)};
  const auto rows = [&](std::size_t chunk) {
    const int begin = px.y0 + int(chunk) * kRowsPerChunk, end = std::min(px.y1, begin + kRowsPerChunk);
    check_interrupt();
    for (int v = begin; v < end; ++v)
      for (int u = px.x0; u < px.x1; ++u) {
        out.put(rays.trace(u, v), std::size_t(v) * camera.width + u);
      }
  };
  parallel_for((px.y1 - px.y0 + kRowsPerChunk - 1) / kRowsPerChunk, threads, rows);
  return out;
}

}  // namespace sdftrack::render
