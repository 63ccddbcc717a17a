// SPDX-License-Identifier: MIT
// Noise and bias of a depth camera from images of known surfaces.
#include "calibration/depth_errors.h"

#include "array.h"
#include "release_gil.h"
#include "volume.h"

namespace sdftrack::bindings {

namespace {

using calibration::ImageNoise, calibration::NoiseSample;

template <class Errors>
ImageNoise noise_of(const py::object& given, const Camera& camera, const Errors& errors) {
  const float* const given_m = given_view(given, camera);
  const ReleaseGil release;
  return calibration::noise_of(errors(), given_m);
}

ImageNoise against_plane(const py::array& depth, const py::object& given, const Camera& camera,
                         const py::array& beside, const Vec3d& normal, double offset_m) {
  const ImageView<float> image = image_view(depth, "depth", camera);
  const auto* off = borrow<unsigned char>(beside, "beside", {camera.height, camera.width});
  return noise_of(given, camera,
                  [&] { return calibration::errors_of_plane(image, camera, off, normal, offset_m); });
}

ImageNoise against_surface(const py::array& depth, const py::object& given, const Camera& camera,
                           const py::array& expected, const py::array& normals) {
  const ImageView<float> image = image_view(depth, "depth", camera);
  const float* z = borrow<float>(expected, "expected", {camera.height, camera.width});
  const float* n = borrow<float>(normals, "normals", {camera.height, camera.width, 3});
  return noise_of(given, camera, [&] {
    return calibration::errors_of_surface(image, camera, z, reinterpret_cast<const Vec3f*>(n));
  });
}

py::tuple fitted_noise(const std::vector<std::tuple<double, double, double, int>>& samples) {
  std::vector<NoiseSample> all;
  for (const auto& [depth_m, tangent, sd_m, readings] : samples)
    all.push_back({depth_m, tangent, sd_m, readings});
  const calibration::NoiseModel found = calibration::fit_noise(all);
  return py::make_tuple(found.noise_m, found.noise_per_m, found.noise_incidence);
}

py::tuple fitted_growth(const std::vector<double>& depth_m, const std::vector<double>& value,
                        bool is_signed) {
  const calibration::Growth found = calibration::fit_growth(depth_m, value, is_signed);
  return py::make_tuple(found.constant, found.per_m2);
}

}  // namespace

void bind_depth_errors(py::module_& m) {
  py::class_<ImageNoise>(m, "ImageNoise",
                         "What an image says of a depth camera's noise and bias; NaN: nothing.")
      .def_readonly("known", &ImageNoise::known)
      .def_readonly("depth_m", &ImageNoise::depth_m)
      .def_readonly("bias_m", &ImageNoise::bias_m)
      .def_readonly("bias_by_tangent", &ImageNoise::bias_by_tangent)
      .def_readonly("correlation", &ImageNoise::correlation)
      .def_readonly("systematic_m", &ImageNoise::systematic_m)
      .def_property_readonly("samples", [](const ImageNoise& self) {
        std::vector<std::tuple<double, double, double, int>> out;
        for (const NoiseSample& s : self.samples) out.emplace_back(s.depth_m, s.tangent, s.sd_m, s.readings);
        return out;
      });
  m.def("plane_noise", &against_plane, "depth"_a, "given"_a, "camera"_a, "beside"_a, "normal"_a,
        "offset_m"_a);
  m.def("surface_noise", &against_surface, "depth"_a, "given"_a, "camera"_a, "expected"_a, "normals"_a);
  m.def("fit_noise", &fitted_noise, "samples"_a, "(noise_m, noise_per_m, noise_incidence).");
  m.def("fit_growth", &fitted_growth, "depth_m"_a, "value"_a, "is_signed"_a, "(constant, per Z^2).");
  m.def("correlation_length", &calibration::correlation_length, "neighbours"_a);
  m.def("span_is_wide", &calibration::span_is_wide, "depth_m"_a);
}

}  // namespace sdftrack::bindings
