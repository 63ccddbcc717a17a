// SPDX-License-Identifier: MIT
#include <algorithm>

#include "array.h"
#include "base/camera.h"
#include "base/parallel.h"
#include "frame/image/depth_metres.h"
#include "release_gil.h"

namespace sdftrack::bindings {

namespace {

Camera make_camera(double fx, double fy, double cx, double cy, int width, int height,
                   const std::vector<double>& distortion) {
  Camera camera{{fx, fy, cx, cy}, width, height, {}};
  if (distortion.size() > camera.distortion.size())
    throw py::value_error("distortion: expected at most 8 numbers");
  std::copy(distortion.begin(), distortion.end(), camera.distortion.begin());
  return camera;
}

py::array_t<double> project_points(const Camera& camera, const py::array& points) {
  const double* p = borrow<double>(points, "points", {-1, 3});
  const auto n = static_cast<std::size_t>(points.shape(0));
  std::vector<double> px(2 * n);
  for (std::size_t i = 0; i < n; ++i) {
    const Vec2d u = camera.project_point({p[3 * i], p[3 * i + 1], p[3 * i + 2]});
    px[2 * i] = u.x, px[2 * i + 1] = u.y;
  }
  return to_numpy(std::move(px), {static_cast<py::ssize_t>(n), 2});
}

py::array_t<float> depth_metres(const py::array& units, double unit_m) {
  const auto* from = borrow<std::uint16_t>(units, "depth", {-1, -1});
  py::array_t<float> out({units.shape(0), units.shape(1)});
  float* const to = out.mutable_data();
  const ReleaseGil release;
  frame::metres_of(from, static_cast<std::size_t>(units.size()), unit_m, to);
  return out;
}

py::array without_lattice(const py::array& depth_m) {
  const auto* from = borrow<float>(depth_m, "depth", {-1, -1});
  const auto height = static_cast<int>(depth_m.shape(0)), width = static_cast<int>(depth_m.shape(1));
  std::vector<float> out;
  {
    const ReleaseGil release;
    if (frame::has_lattice({from, width, height})) {
      out.assign(from, from + depth_m.size());
      frame::fill_lattice(width, height, out.data());
    }
  }
  return out.empty() ? depth_m : to_numpy(std::move(out), {depth_m.shape(0), depth_m.shape(1)});
}

}  // namespace

void bind_base(py::module_& m) {
  m.def("thread_count", &thread_count, "requested"_a = 0, "Threads used when `requested` are asked for.");
  m.def("depth_metres", &depth_metres, "units"_a, "unit_m"_a,
        "Depth of 16 bits as metres, the nearest float32.");
  m.def("without_lattice", &without_lattice, "depth_m"_a,
        "The depth with the holes of a registration filled; the same array without such holes.");
  py::class_<Camera>(m, "Camera", "Pinhole camera with Brown-Conrady distortion; see sdftrack.Camera.")
      .def(py::init(&make_camera), "fx"_a, "fy"_a, "cx"_a, "cy"_a, "width"_a, "height"_a,
           "distortion"_a = std::vector<double>{})
      .def_property_readonly("width", [](const Camera& c) { return c.width; })
      .def_property_readonly("height", [](const Camera& c) { return c.height; })
      .def("project", &project_points, "points"_a, "(N, 3) float64, m, camera frame -> (N, 2) pixels.")
      .def(
          "rays",
          [](const Camera& c) {
            return to_numpy(ray_table(c), {c.height, c.width, 2});
          },
          "(H, W, 2) float32: x / z and y / z of every pixel's ray, distortion removed.");
  m.def(
      "rotation_exp",
      [](const Vec3d& w_rad) {
        return Rigidd{rotation_exp(w_rad), {0, 0, 0}};
      },
      "w_rad"_a, "Rotation vector to a 4x4 rotation.");
  m.def(
      "rotation_log", [](const py::array& T) { return rotation_log(rigid_from(T, "T").R); }, "T"_a,
      "Rotation vector (rad) of a 4x4 pose.");
  m.def(
      "nearest_rigid",
      [](const py::array& T, const std::string& name) { return rigid_from(T, name.c_str()); }, "T"_a,
      "name"_a = "T",
      "4x4 float64, rotation to within 0.01, projected onto the rotations; ValueError beyond.");
}

}  // namespace sdftrack::bindings
