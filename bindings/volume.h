// SPDX-License-Identifier: MIT
// Volumes and images from numpy, as views.
#pragma once

#include <array>
#include <tuple>

#include "array.h"
#include "base/views.h"
#include "energies/color_field.h"
#include "frame/region.h"
#include "sdf/grid.h"
#include "sdf/mesh.h"

namespace sdftrack::bindings {

// A grid with this number of voxels. Throws ValueError if its size, its voxels or its origin exceed the range
// of the core's indices and floats; `name` is the argument that gives the number of voxels.
sdf::Grid grid_from(const std::array<py::ssize_t, 3>& shape_zyx, double voxel_m, const Vec3d& origin,
                    const char* name = "values");
// float32 [z, y, x]; origin: object coordinates of voxel (0, 0, 0)'s centre, metres. The caller owns the
// array.
SdfView volume_view(const py::array& values, double voxel_m, const Vec3d& origin);
using PyVolume = std::tuple<py::array, double, Vec3d>;  // values, voxel (m), origin (m)
inline SdfView volume_view(const PyVolume& volume) {
  return volume_view(std::get<0>(volume), std::get<1>(volume), std::get<2>(volume));
}
// finite: refuses vertices that are not.
sdf::MeshView mesh_view(const py::array& vertices, const py::array& faces, bool finite = true);
// uint16 (z, y, x, 4) of a volume: red, green, blue times 256 and how much was seen.
energies::ColorView painted_view(const py::array& colors, const SdfView& sdf);
// float32 (H, W) of the camera's size.
ImageView<float> image_view(const py::array& image, const char* name, const Camera& camera);
// The same of a depth image before its holes were filled, or None: nothing was filled.
const float* given_view(const py::object& given, const Camera& camera);
// A frame of such a depth image; rays: (H, W, 2) of a camera with distortion, or None.
frame::DepthFrame depth_frame(const py::array& depth, const Camera& camera, const py::object& rays);
// A frame of such a depth image and a mask, with the rays of its camera.
struct FrameWithRays {
  std::vector<float> rays;
  frame::DepthFrame frame;
  FrameWithRays(const py::array& depth, const py::object& mask, const Camera& camera);
};
// uint8 (H, W) of the camera's size, or None.
const unsigned char* mask_view(const py::object& mask, const Camera& camera);

}  // namespace sdftrack::bindings
