// SPDX-License-Identifier: MIT
// The rays of sdf_ray.h, a thread for each pixel that the volume's box covers. The CPU's test of tiles is
// left out: it would take a thread as many steps as its own ray.
#include "base/device_pool.h"
#include "base/device_volumes.h"
#include "base/launch.cuh"
#include "render/pixel_box.h"
#include "render/raycast_sdf.h"
#include "render/sdf_ray.h"

namespace sdftrack::render {

namespace {

constexpr int kTile = 8;                 // rays of a block lie side by side, so that they share voxels
constexpr std::size_t kMostVolumes = 8;  // volumes that stay on the device between calls
constexpr std::size_t kPlanes = 4;       // depth and the normal's x, y, z, pixel by pixel

struct TraceRays {
  static constexpr const char* kName = "ray casting";
  static constexpr int kThreads = kTile * kTile;
  SdfRays rays;
  PixelBox px;
  float *depth, *normals;

  __device__ void operator()() const {
    const int u = px.x0 + int(blockIdx.x * kTile + threadIdx.x),
              v = px.y0 + int(blockIdx.y * kTile + threadIdx.y);
    if (u >= px.x1 || v >= px.y1) return;
    const Hit hit = rays.trace(u, v);
    const std::size_t at = std::size_t(v - px.y0) * std::size_t(px.x1 - px.x0) + std::size_t(u - px.x0);
    depth[at] = hit.depth_m;
    normals[3 * at] = hit.normal_cam.x;
    normals[3 * at + 1] = hit.normal_cam.y;
    normals[3 * at + 2] = hit.normal_cam.z;
  }
};

struct Work {
  DeviceStream stream;
  DeviceVolumes volumes{kMostVolumes};
  DeviceBuffer<float> pixels;
  PinnedBuffer<float> staging;
};

}  // namespace

SdfImage raycast_sdf_cuda(const SdfView& sdf, const Camera& camera, const Rigidd& T_cam_obj, int device) {
  SdfImage out(camera);
  const Box box = box_of(sdf);
  const PixelBox px = pixel_box(camera, T_cam_obj, box.low, box.high);
  const auto work = pool_of<Work>().borrow(device);  // an unknown device is an error even if the box is empty
  if (px.empty()) return out;
  const DeviceStream& stream = work->stream;
  const auto width = std::size_t(px.x1 - px.x0), height = std::size_t(px.y1 - px.y0), count = width * height;
  work->volumes.begin_frame();
  float *pixels = work->pixels.room(kPlanes * count), *staging = work->staging.room(kPlanes * count);
  launch(stream, dim3(blocks_of(px.x1 - px.x0, kTile), blocks_of(px.y1 - px.y0, kTile)),
         TraceRays{{work->volumes.send(sdf, stream), camera, T_cam_obj}, px, pixels, pixels + count},
         dim3(kTile, kTile));
  stream.download(pixels, kPlanes * count, staging);
  stream.wait();
  for (std::size_t row = 0; row < height; ++row) {
    const std::size_t at = (std::size_t(px.y0) + row) * camera.width + px.x0;
    std::copy_n(staging + row * width, width, out.depth_m.data() + at);
    std::copy_n(staging + count + 3 * row * width, 3 * width, out.normals_cam.data() + 3 * at);
  }
  return out;
}

}  // namespace sdftrack::render
