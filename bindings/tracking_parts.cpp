// SPDX-License-Identifier: MIT
// What the tracker takes, and two of its parts that tests compare with numpy.
#include <pybind11/native_enum.h>
#include <pybind11/stl.h>

#include "appearance.h"
#include "array.h"
#include "py_tracker.h"
#include "region_colors.h"
#include "tracking/fit/correlation.h"

namespace sdftrack::bindings {

namespace {

double correlation_area(const py::array& u_px, const py::array& v_px, const py::array& residual_m,
                        double scale_m, double outlier_floor) {
  const py::ssize_t n = u_px.size();
  const float* u = borrow<float>(u_px, "u_px", {-1});
  const float* v = borrow<float>(v_px, "v_px", {n});
  const float* residual = borrow<float>(residual_m, "residual_m", {n});
  energies::PixelSet pixels;
  for (py::ssize_t i = 0; i < n; ++i) {
    pixels.push(u[i], v[i], 0.0f, 1.0f);
    pixels.hit_m.back() = residual[i], pixels.gain.back() = 0;
  }
  return tracking::CorrelationArea().measure(
      pixels, {static_cast<float>(scale_m), static_cast<float>(outlier_floor)});
}

}  // namespace

void bind_tracking_parts(py::module_& m) {
  py::native_enum<tracking::MotionModel>(m, "MotionModel", "enum.Enum",
                                         "Where an object is expected in the next frame.")
      .value("static", tracking::MotionModel::kStatic)
      .value("constant_velocity", tracking::MotionModel::kConstantVelocity)
      .value("adaptive", tracking::MotionModel::kAdaptive)
      .finalize();
  py::native_enum<tracking::Collision>(m, "Collision", "enum.Enum", "Penalty on the penetration of objects.")
      .value("none", tracking::Collision::kNone)
      .value("contact", tracking::Collision::kContact)
      .value("printed", tracking::Collision::kPrinted)
      .finalize();
  py::class_<PyFrame>(m, "TrackerFrame", "A frame for Tracker; without depth, `error` may give the reason.")
      .def(py::init<py::object, py::object, py::object, py::object, double, std::string>(), py::arg("depth"),
           py::arg("mask") = py::none(), py::arg("color") = py::none(), py::arg("color_map") = py::none(),
           py::arg("time_s") = tracking::kUnknown, py::arg("error") = "");
  m.def("correlation_area", &correlation_area, py::arg("u_px"), py::arg("v_px"), py::arg("residual_m"),
        py::arg("scale_m"), py::arg("outlier_floor"),
        "Number of pixels that share one error; 0: too few to estimate it.");

  m.def(
      "colors_at",
      [](const py::array& depth, const py::object& color, const py::object& map,
         const std::array<int, 4>& region) {
        const appearance::ColorImage image = color_view(color, map);
        const float* z = borrow<float>(depth, "depth", {-1, -1});
        const auto h = static_cast<int>(depth.shape(0)), w = static_cast<int>(depth.shape(1));
        check_region(region, w, h);
        frame::DepthFrame frame{{z, w, h}, nullptr, nullptr};
        frame.color = &image;
        std::vector<std::uint8_t> rgb;
        fetch_colors(frame, {region[0], region[1], region[2], region[3]}, &rgb);
        return to_numpy(std::move(rgb), {region[3] - region[1], region[2] - region[0], 3});
      },
      py::arg("depth"), py::arg("color"), py::arg("color_map"), py::arg("region"));
}

}  // namespace sdftrack::bindings
