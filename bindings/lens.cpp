// SPDX-License-Identifier: MIT
#include <pybind11/native_enum.h>
#include <pybind11/stl.h>

#include "array.h"
#include "calibration/intrinsics.h"

namespace sdftrack::bindings {

namespace {

calibration::Lens lens_from(const Camera& camera, double skew, double depth_scale, double depth_offset_m) {
  return {camera, skew, depth_scale, depth_offset_m};
}

std::vector<double> lens_values(const calibration::Lens& lens) {
  std::vector<double> out;
  for (int j = 0; j < calibration::kLensUnknowns; ++j)
    out.push_back(lens.get(static_cast<calibration::LensUnknown>(j)));
  return out;
}

}  // namespace

void bind_lens(py::module_& m) {
  py::class_<calibration::Lens>(m, "Lens", "A depth camera with skew, depth scale and depth offset.")
      .def(py::init(&lens_from), py::arg("camera"), py::arg("skew") = 0.0, py::arg("depth_scale") = 1.0,
           py::arg("depth_offset_m") = 0.0)
      .def_property_readonly("values", &lens_values,
                             "fx, fy, cx, cy, skew, k1, k2, depth scale, depth offset (m).")
      .def(
          "look_through",
          [](const calibration::Lens& lens, double u_px, double v_px) {
            const calibration::LensRay r = calibration::look_through(lens, true, u_px, v_px);
            return py::make_tuple(py::make_tuple(r.ray.x, r.ray.y), r.dx, r.dy);
          },
          py::arg("u_px"), py::arg("v_px"), "(x, y) of a pixel's ray, and their derivatives by the values.");
  py::native_enum<energies::Residual>(m, "Residual", "enum.Enum", "What a pixel's residual is.")
      .value("point", energies::Residual::kPoint)
      .value("slope", energies::Residual::kSlope)
      .value("ray_hit", energies::Residual::kRayHit)
      .finalize();
  py::class_<calibration::IntrinsicsOptions>(m, "IntrinsicsOptions", "Options of a calibration.")
      .def(py::init<>())
      .def_readwrite("residual", &calibration::IntrinsicsOptions::residual)
      .def_readwrite("max_pixels", &calibration::IntrinsicsOptions::max_pixels)
      .def_readwrite("padding_m", &calibration::IntrinsicsOptions::padding_m)
      .def_readwrite("min_scale_m", &calibration::IntrinsicsOptions::min_scale_m)
      .def_readwrite("outlier_floor", &calibration::IntrinsicsOptions::outlier_floor)
      .def_readwrite("coarse_steps", &calibration::IntrinsicsOptions::coarse_steps)
      .def_readwrite("fine_steps", &calibration::IntrinsicsOptions::fine_steps)
      .def_readwrite("coarse_pixels", &calibration::IntrinsicsOptions::coarse_pixels)
      .def_readwrite("fine_pixels", &calibration::IntrinsicsOptions::fine_pixels)
      .def_readwrite("twin_pixels", &calibration::IntrinsicsOptions::twin_pixels)
      .def_readwrite("threads", &calibration::IntrinsicsOptions::threads);
}

}  // namespace sdftrack::bindings
