// SPDX-License-Identifier: MIT
// The rays of mesh_ray.h, a thread for each pixel that the mesh's box covers.

#include "base/device_pool.h"
#include "base/launch.cuh"
#include "render/pixel_box.h"
#include "render/raycast_mesh.h"

namespace sdftrack::render {

namespace {

constexpr int kTile = 8;  // rays of a block lie side by side, so that they share nodes

struct TraceMesh {
  static constexpr const char* kName = "ray casting of a mesh";
  static constexpr int kThreads = kTile * kTile;
  MeshRays rays;
  PixelBox px;
  MeshHit* out;

  __device__ void operator()() const {
    const int u = px.x0 + int(blockIdx.x * kTile + threadIdx.x),
              v = px.y0 + int(blockIdx.y * kTile + threadIdx.y);
    if (u >= px.x1 || v >= px.y1) return;
    out[std::size_t(v - px.y0) * std::size_t(px.x1 - px.x0) + std::size_t(u - px.x0)] = rays.trace(u, v);
  }
};

struct Work {
  DeviceStream stream;
  std::uint64_t id = 0;  // of the mesh on the device
  DeviceBuffer<Vec3d> vertices;
  DeviceBuffer<sdf::Face> faces;
  DeviceBuffer<sdf::BvhNode> nodes;
  DeviceBuffer<sdf::Triangle> triangles;
  DeviceBuffer<std::int32_t> indices;
  DeviceBuffer<std::uint8_t> colors;
  DeviceBuffer<MeshHit> hits;
  PinnedBuffer<MeshHit> staging;

  template <class T>
  static const T* send(const DeviceStream& stream, const T* from, std::size_t count, DeviceBuffer<T>* to) {
    T* const there = to->room(count);
    stream.upload(from, count, there);
    return there;
  }
  // Uploads the mesh and its hierarchy.
  void send(const sdf::MeshView& mesh, const sdf::Bvh& bvh, std::uint64_t mesh_id) {
    if (mesh_id != 0 && mesh_id == id) return;
    id = 0;  // until the upload is complete
    const sdf::BvhView view = bvh.view();
    send(stream, mesh.vertices, mesh.vertex_count, &vertices);
    send(stream, mesh.faces, mesh.face_count, &faces);
    send(stream, view.nodes, bvh.node_count(), &nodes);
    send(stream, view.triangles, mesh.face_count, &triangles);
    send(stream, view.faces, mesh.face_count, &indices);
    stream.wait();
    id = mesh_id;
  }
};

}  // namespace

MeshImage raycast_mesh_cuda(const sdf::MeshView& mesh, const sdf::Bvh& bvh, std::uint64_t id,
                            const std::uint8_t* colors, const Camera& camera, const Rigidd& T_cam_obj,
                            int device) {
  MeshImage out(camera, colors != nullptr);
  const PixelBox px = pixel_box(camera, T_cam_obj, bvh.box().low, bvh.box().high);
  const auto work = pool_of<Work>().borrow(device);
  if (px.empty()) return out;
  const DeviceStream& stream = work->stream;
  const auto width = std::size_t(px.x1 - px.x0), height = std::size_t(px.y1 - px.y0), count = width * height;
  work->send(mesh, bvh, id);
  const std::uint8_t* const rgb =
      colors ? Work::send(stream, colors, 3 * mesh.vertex_count, &work->colors) : nullptr;
  MeshHit *hits = work->hits.room(count), *staging = work->staging.room(count);
  const MeshRays rays{{work->vertices.data(), mesh.vertex_count, work->faces.data(), mesh.face_count},
                      {work->nodes.data(), work->triangles.data(), work->indices.data()},
                      rgb,
                      LensRays(camera),
                      T_cam_obj,
                      inverse(T_cam_obj)};
  launch(stream, dim3(blocks_of(px.x1 - px.x0, kTile), blocks_of(px.y1 - px.y0, kTile)),
         TraceMesh{rays, px, hits}, dim3(kTile, kTile));
  stream.download(hits, count, staging);
  stream.wait();
  for (std::size_t row = 0; row < height; ++row)
    for (std::size_t column = 0; column < width; ++column) {
      const MeshHit& hit = staging[row * width + column];
      out.put(hit, (std::size_t(px.y0) + row) * camera.width + px.x0 + column);
    }
  return out;
}

}  // namespace sdftrack::render
