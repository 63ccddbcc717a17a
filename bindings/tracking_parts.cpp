// SPDX-License-Identifier: MIT
// The tracker's inputs, and parts of the tracker that tests compare with numpy.
#include <pybind11/eigen.h>
#include <pybind11/native_enum.h>
#include <pybind11/stl.h>

#include "appearance.h"
#include "array.h"
#include "py_tracker.h"
#include "tracking/fit/correlation.h"
#include "tracking/size/depth_size.h"
#include "tracking/trust/open_directions.h"
#include "volume.h"

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

using VolumeParts = std::tuple<py::array, double, std::array<double, 3>>;

SdfView view_of(const VolumeParts& volume) {
  const auto& [values, voxel_m, origin] = volume;
  return volume_view(values, voxel_m, origin);
}

// Rows of pixels: u, v (px), depth (m), P_f, depth of the hit, gain.
py::tuple look_at_form(const VolumeParts& volume, const Camera& camera, const py::array& pixels,
                       double color_prior, const py::array& T_cam_obj, double noise_m, double systematic_m) {
  energies::PixelSet set;
  const float* row = borrow<float>(pixels, "pixels", {-1, 6});
  for (py::ssize_t i = 0; i < pixels.shape(0); ++i, row += 6) {
    set.push(row[0], row[1], row[2], 1.0f, 0, row[3]);
    set.hit_m.back() = row[4], set.gain.back() = row[5];
  }
  const frame::Shape shape = frame::make_shape(view_of(volume), 960, 1);
  const Rigidd T = rigid_from(T_cam_obj, "T_cam_obj"), T_obj_cam = inverse(Rigidd{T.R, T * shape.centre_obj});
  const auto prior = static_cast<float>(color_prior);
  const auto size = tracking::size_by_depth(set, prior, shape, camera, T_obj_cam, noise_m, systematic_m);
  const auto form = tracking::strain_by_depth(set, prior, shape, camera, T_obj_cam, noise_m, systematic_m);
  py::object size_row = py::none(), form_row = py::none();
  if (size)
    size_row =
        py::make_tuple(size->log_scale, size->own_var, size->shared_var, size->pull, size->unexplained);
  if (form) {
    const auto most = form->largest();
    form_row =
        py::make_tuple(form->strain, form->own_cov, form->shared_cov, most.axis, most.log_stretch, most.sd);
  }
  return py::make_tuple(size_row, form_row);
}

// All of the volume counts as seen.
py::tuple fused_form(const VolumeParts& volume, const Camera& camera, const py::array& depth_m,
                     const py::array& T_cam_obj, int points, double tolerance_m) {
  const SdfView sdf = view_of(volume);
  const frame::Shape shape =
      frame::make_shape(frame::PartialShape{sdf, {}, {}, {{0, 0, 0, sdf.nx, sdf.ny, sdf.nz}}, {}}, points, 0);
  const frame::DepthFrame frame{image_view(depth_m, "depth", camera), nullptr, nullptr};
  const Eigen::MatrixXd form =
      tracking::seen_form(frame, camera, shape, rigid_from(T_cam_obj, "T_cam_obj"), tolerance_m);
  std::vector<float> rows;
  for (std::size_t i = 0; i < shape.points.size(); ++i)
    for (const Vec3f& v : {shape.points[i], shape.normals[i]}) rows.insert(rows.end(), {v.x, v.y, v.z});
  return py::make_tuple(form, tracking::least_form_slope(shape),
                        to_numpy(std::move(rows), {static_cast<py::ssize_t>(shape.points.size()), 6}));
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
  m.def("look_at_form", &look_at_form, py::arg("volume"), py::arg("camera"), py::arg("pixels"),
        py::arg("color_prior"), py::arg("T_cam_obj"), py::arg("noise_m"), py::arg("systematic_m"),
        "Size (log scale, own and shared variance, pull, unexplained) and form (strain, own and shared "
        "covariance, axis, log stretch, sd) by the depth of one frame; each None where it says nothing.");
  m.def("seen_form", &fused_form, py::arg("volume"), py::arg("camera"), py::arg("depth"),
        py::arg("T_cam_obj"), py::arg("points"), py::arg("tolerance_m"),
        "Mean of J J^T where a fused shape is read, the least slope of a form; points and normals (n, 6).");
}

}  // namespace sdftrack::bindings
