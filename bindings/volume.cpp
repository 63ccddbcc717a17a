// SPDX-License-Identifier: MIT
#include "volume.h"

#include <limits>

namespace sdftrack {

SdfView volume_view(const py::array& values, double voxel_m, const std::array<double, 3>& origin) {
  const float* phi = borrow<float>(values, "values", {-1, -1, -1});
  for (int axis = 0; axis < 3; ++axis)
    if (values.shape(axis) < 2)
      throw py::value_error("values: expected at least 2 voxels along each axis, got " + describe(values));
  if (values.size() > std::numeric_limits<int>::max())
    throw py::value_error("values: expected fewer than 2^31 voxels, got " + describe(values));
  if (!(voxel_m > 0)) throw py::value_error("voxel_size: expected a positive length in metres");
  return {phi,
          static_cast<int>(values.shape(2)),
          static_cast<int>(values.shape(1)),
          static_cast<int>(values.shape(0)),
          static_cast<float>(voxel_m),
          Vec3d{origin[0], origin[1], origin[2]}.cast<float>()};
}

ImageView<float> image_view(const py::array& image, const char* name, const Camera& camera) {
  return {borrow<float>(image, name, {camera.height, camera.width}), camera.width, camera.height};
}

const unsigned char* mask_view(const py::object& mask, const Camera& camera) {
  if (mask.is_none()) return nullptr;
  return borrow<unsigned char>(mask.cast<py::array>(), "mask", {camera.height, camera.width});
}

}  // namespace sdftrack
