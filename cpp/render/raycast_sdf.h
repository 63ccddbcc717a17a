// SPDX-License-Identifier: MIT
// Depth and normals of a distance volume: sphere tracing, then the root of the interpolant along the ray.
#pragma once

#include <vector>

#include "base/camera.h"
#include "base/rigid.h"
#include "base/views.h"

namespace sdftrack::render {

struct SdfImage {
  std::vector<float> depth_m;      // H x W, z, 0 where nothing is hit
  std::vector<float> normals_cam;  // H x W x 3, unit, the gradient of phi at the hit

  SdfImage() = default;
  explicit SdfImage(const Camera& camera);  // an image without hits
};

// threads 0: all cores; the image does not depend on it.
SdfImage raycast_sdf(const SdfView& sdf, const Camera& camera, const Rigidd& T_cam_obj, int threads);

// The same image from a GPU, which keeps the last volumes that have an id.
SdfImage raycast_sdf_cuda(const SdfView& sdf, const Camera& camera, const Rigidd& T_cam_obj, int device);

}  // namespace sdftrack::render
