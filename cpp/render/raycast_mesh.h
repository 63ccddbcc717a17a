// SPDX-License-Identifier: MIT
// Depth, normal and colour of a triangle mesh, by exact ray casting: ground truth independent of any SDF.
#pragma once

#include <cstdint>
#include <vector>

#include "base/camera.h"
#include "base/rigid.h"
#include "render/mesh_ray.h"
#include "sdf/bvh.h"

namespace sdftrack::render {

struct MeshImage {
  std::vector<float> depth_m;        // H x W, z, 0 where nothing is hit
  std::vector<float> normals_cam;    // H x W x 3, unit, of the face, towards the camera
  std::vector<std::uint8_t> colors;  // H x W x 3, empty without vertex colours

  MeshImage() = default;
  MeshImage(const Camera& camera, bool colored);  // an image without hits
  void put(const MeshHit& hit, std::size_t pixel);
};

// `colors`: 3 bytes a vertex, or nullptr. threads 0: all cores; the image does not depend on it.
MeshImage raycast_mesh(const sdf::MeshView& mesh, const sdf::Bvh& bvh, const std::uint8_t* colors,
                       const Camera& camera, const Rigidd& T_cam_obj, int threads);

// The same image from a GPU, which keeps the last mesh by its id; 0: the mesh is sent again.
MeshImage raycast_mesh_cuda(const sdf::MeshView& mesh, const sdf::Bvh& bvh, std::uint64_t id,
                            const std::uint8_t* colors, const Camera& camera, const Rigidd& T_cam_obj,
                            int device);

}  // namespace sdftrack::render
