// SPDX-License-Identifier: MIT
#include "volume.h"

#include <cmath>
#include <limits>
#include <string>

#include "base/short_text.h"

namespace sdftrack::bindings {

namespace {

// Range of a voxel's size: its square and the inverse of the square must also be floats.
constexpr double kLeast_m = 1e-12, kMost_m = 1e12;
constexpr double kFarthest_m = 1e15;  // of an origin

}  // namespace

sdf::Grid grid_from(const std::array<py::ssize_t, 3>& shape_zyx, double voxel_m, const Vec3d& origin,
                    const char* name) {
  constexpr py::ssize_t kMost = std::numeric_limits<int>::max();
  const auto [nz, ny, nx] = shape_zyx;
  const std::string got = ", got " + shape_text({nz, ny, nx});
  if (nx < 2 || ny < 2 || nz < 2)
    throw py::value_error(std::string(name) + ": expected at least 2 voxels along each axis" + got);
  if (nx > kMost / ny || nx * ny > kMost / nz)
    throw py::value_error(std::string(name) + ": expected fewer than 2^31 voxels" + got);
  if (!(voxel_m >= kLeast_m && voxel_m <= kMost_m))
    throw py::value_error("voxel_size: expected a length from 1e-12 to 1e12 metres, got " +
                          short_text(voxel_m));
  for (const double x : {origin.x, origin.y, origin.z})
    if (!(std::abs(x) <= kFarthest_m))
      throw py::value_error("origin: expected coordinates of at most 1e15 metres, got " + short_text(x));
  return {static_cast<int>(nx), static_cast<int>(ny), static_cast<int>(nz), voxel_m, origin};
}

SdfView volume_view(const py::array& values, double voxel_m, const Vec3d& origin) {
  const float* phi = borrow<float>(values, "values", {-1, -1, -1});
  return grid_from({values.shape(0), values.shape(1), values.shape(2)}, voxel_m, origin).view(phi);
}

sdf::MeshView mesh_view(const py::array& vertices, const py::array& faces, bool finite) {
  const double* v = borrow<double>(vertices, "vertices", {-1, 3});
  const std::int32_t* f = borrow<std::int32_t>(faces, "faces", {-1, 3});
  for (py::ssize_t i = 0; i < vertices.size(); ++i)
    if (finite && !std::isfinite(v[i])) throw py::value_error("vertices: every coordinate must be finite");
  for (py::ssize_t i = 0; i < faces.size(); ++i)
    if (f[i] < 0 || f[i] >= vertices.shape(0))
      throw py::value_error("faces: vertex index " + std::to_string(f[i]) + " is outside 0.." +
                            std::to_string(vertices.shape(0) - 1));
  return {reinterpret_cast<const Vec3d*>(v), static_cast<std::size_t>(vertices.shape(0)),
          reinterpret_cast<const sdf::Face*>(f), static_cast<std::size_t>(faces.shape(0))};
}

energies::ColorView painted_view(const py::array& colors, const SdfView& sdf) {
  constexpr py::ssize_t kVoxel = 4 * sizeof(std::uint16_t);
  const bool fits = py::isinstance<py::array_t<std::uint16_t>>(colors) && colors.ndim() == 4 &&
                    colors.shape(0) == sdf.nz && colors.shape(1) == sdf.ny && colors.shape(2) == sdf.nx &&
                    colors.shape(3) == 4 && colors.strides(3) == 2 && colors.strides(2) == kVoxel &&
                    colors.strides(1) == kVoxel * sdf.nx && colors.strides(0) == kVoxel * sdf.nx * sdf.ny;
  if (!fits)
    throw py::type_error("colors: expected uint16 (z, y, x, 4) beside the volume, got " + describe(colors));
  return {static_cast<const std::uint16_t*>(colors.data())};
}

ImageView<float> image_view(const py::array& image, const char* name, const Camera& camera) {
  return {borrow<float>(image, name, {camera.height, camera.width}), camera.width, camera.height};
}

const float* given_view(const py::object& given, const Camera& camera) {
  return given.is_none() ? nullptr : image_view(given.cast<py::array>(), "given", camera).data;
}

frame::DepthFrame depth_frame(const py::array& depth, const Camera& camera, const py::object& rays) {
  frame::DepthFrame frame{image_view(depth, "depth", camera), nullptr, nullptr};
  if (!rays.is_none())
    frame.rays = borrow<float>(py::cast<py::array>(rays), "rays", {camera.height, camera.width, 2});
  return frame;
}

FrameWithRays::FrameWithRays(const py::array& depth, const py::object& mask, const Camera& camera)
    : rays(camera.distorted() ? ray_table(camera) : std::vector<float>{}),
      frame{image_view(depth, "depth", camera), mask_view(mask, camera),
            rays.empty() ? nullptr : rays.data()} {}

const unsigned char* mask_view(const py::object& mask, const Camera& camera) {
  if (mask.is_none()) return nullptr;
  return borrow<unsigned char>(mask.cast<py::array>(), "mask", {camera.height, camera.width});
}

}  // namespace sdftrack::bindings
