// SPDX-License-Identifier: MIT
#include <pybind11/eigen.h>
#include <pybind11/stl.h>

#include "appearance.h"
#include "array.h"
#include "py_tracker.h"
#include "region_colors.h"
#include "tracking/correlation.h"

namespace sdftrack {

namespace {

double correlation_area(const py::array& u_px, const py::array& v_px, const py::array& residual_m,
                        double scale_m, double outlier_floor) {
  const py::ssize_t n = u_px.size();
  const float* u = borrow<float>(u_px, "u_px", {-1});
  const float* v = borrow<float>(v_px, "v_px", {n});
  const float* residual = borrow<float>(residual_m, "residual_m", {n});
  PixelSet pixels;
  for (py::ssize_t i = 0; i < n; ++i) {
    pixels.push(u[i], v[i], 0.0f, 1.0f);
    pixels.hit_m.back() = residual[i], pixels.gain.back() = 0;
  }
  return CorrelationArea().measure(pixels, {static_cast<float>(scale_m), static_cast<float>(outlier_floor)});
}

}  // namespace

void bind_tracker_options(py::module_& m);

void bind_tracking(py::module_& m) {
  bind_tracker_options(m);
  py::enum_<MotionModel>(m, "MotionModel", "Where an object is expected in the next frame.")
      .value("static", MotionModel::kStatic)
      .value("constant_velocity", MotionModel::kConstantVelocity);
  py::enum_<Collision>(m, "Collision", "What it costs objects to stand in one another.")
      .value("none", Collision::kNone)
      .value("contact", Collision::kContact)
      .value("printed", Collision::kPrinted);
  py::class_<PyTracker>(m, "Tracker", "Tracks shapes; see sdftrack.Tracker.")
      .def(py::init<const std::vector<PyVolume>&, const Camera&, const TrackerOptions&, int, bool,
                    MotionModel, bool, Collision>(),
           py::arg("shapes"), py::arg("camera"), py::arg("options"), py::arg("threads"), py::arg("recover"),
           py::arg("motion"), py::arg("cuda"), py::arg("collision"))
      .def("start", &PyTracker::start, py::arg("depth"), py::arg("mask"), py::arg("time_s"),
           py::arg("places"), py::arg("color") = py::none(), py::arg("color_map") = py::none())
      .def("track", &PyTracker::track, py::arg("depth"), py::arg("mask"), py::arg("time_s"),
           py::arg("color") = py::none(), py::arg("color_map") = py::none())
      .def("recover", &PyTracker::recover, py::arg("depth"), py::arg("mask"), py::arg("time_s"),
           py::arg("objects"), py::arg("places"), py::arg("color") = py::none(),
           py::arg("color_map") = py::none())
      .def("add", &PyTracker::add, py::arg("shape"), py::arg("place"))
      .def("remove", &PyTracker::remove, py::arg("k"))
      .def("judge", &PyTracker::judge, py::arg("depth"), py::arg("mask"), py::arg("k"), py::arg("T"))
      .def("reshape", &PyTracker::reshape, py::arg("k"), py::arg("shape"), py::arg("seen"), py::arg("least"),
           py::arg("boxes"), py::arg("colors") = py::none())
      .def("region", &PyTracker::region, py::arg("k"), py::arg("T"), py::arg("padding_m"))
      .def("look_at", &PyTracker::look_at, py::arg("depth"), py::arg("color"), py::arg("color_map"),
           py::arg("k"), py::arg("region"))
      .def("paint", &PyTracker::paint, py::arg("k"), py::arg("colors"))
      .def("overlaps", &PyTracker::overlaps, py::arg("of"))
      .def("membership", &PyTracker::membership, py::arg("depth"), py::arg("color") = py::none(),
           py::arg("color_map") = py::none())
      .def("set_camera", &PyTracker::set_camera, py::arg("camera"))
      .def("set_pose", &PyTracker::set_pose, py::arg("k"), py::arg("T"), py::arg("covariance"));
  m.def(
      "twists",
      [](const py::array& before, const py::array& now, double elapsed_s) {
        const py::ssize_t n = before.ndim() > 0 ? before.shape(0) : 0;
        const double* a = borrow<double>(before, "before", {n, 4, 4});
        const double* b = borrow<double>(now, "now", {n, 4, 4});
        py::array_t<double> out({n, py::ssize_t{6}});
        for (py::ssize_t k = 0; k < n; ++k) {
          const Rigidd from = read_matrix(a + 16 * k), to = read_matrix(b + 16 * k);
          const Vec3d v = (1 / elapsed_s) * (to.t - from.t);
          const Vec3d w = (1 / elapsed_s) * rotation_log(to.R * transpose(from.R));
          const double twist[6] = {v.x, v.y, v.z, w.x, w.y, w.z};
          std::copy(twist, twist + 6, out.mutable_data(k, 0));
        }
        return out;
      },
      py::arg("before"), py::arg("now"), py::arg("elapsed_s"),
      "(v, w) from poses to poses, (M, 4, 4) each, camera axes.");
  m.def("correlation_area", &correlation_area, py::arg("u_px"), py::arg("v_px"), py::arg("residual_m"),
        py::arg("scale_m"), py::arg("outlier_floor"), "Pixels that share one error; 0: too few to tell.");

  m.def(
      "colors_at",
      [](const py::array& depth, const py::object& color, const py::object& map,
         const std::array<int, 4>& region) {
        const ColorImage image = color_view(color, map);
        const auto h = static_cast<int>(depth.shape(0)), w = static_cast<int>(depth.shape(1));
        DepthFrame frame{{borrow<float>(depth, "depth", {h, w}), w, h}, nullptr, nullptr};
        frame.color = &image;
        std::vector<std::uint8_t> rgb;
        fetch_colors(frame, {region[0], region[1], region[2], region[3]}, &rgb);
        return to_numpy(std::move(rgb), {region[3] - region[1], region[2] - region[0], 3});
      },
      py::arg("depth"), py::arg("color"), py::arg("color_map"), py::arg("region"));
}

}  // namespace sdftrack
