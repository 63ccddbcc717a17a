// SPDX-License-Identifier: MIT
// Parts of the tracker that tests compare with numpy.
#include <pybind11/eigen.h>

#include "array.h"
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

// Rows of pixels: u, v (px), depth (m), P_f, depth of the hit, gain.
py::tuple look_at_form(const PyVolume& volume, const Camera& camera, const py::array& pixels,
                       double color_prior, const py::array& T_cam_obj, double noise_m, double systematic_m) {
  energies::PixelSet set;
  const float* row = borrow<float>(pixels, "pixels", {-1, 6});
  for (py::ssize_t i = 0; i < pixels.shape(0); ++i, row += 6) {
    set.push(row[0], row[1], row[2], 1.0f, 0, row[3]);
    set.hit_m.back() = row[4], set.gain.back() = row[5];
  }
  const frame::Shape shape = frame::make_shape(volume_view(volume), 960, 1);
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
py::tuple fused_form(const PyVolume& volume, const Camera& camera, const py::array& depth_m,
                     const py::array& T_cam_obj, int points, double tolerance_m) {
  const SdfView sdf = volume_view(volume);
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
  m.def("correlation_area", &correlation_area, "u_px"_a, "v_px"_a, "residual_m"_a, "scale_m"_a,
        "outlier_floor"_a, "Number of pixels that share one error; 0: too few to estimate it.");
  m.def("look_at_form", &look_at_form, "volume"_a, "camera"_a, "pixels"_a, "color_prior"_a, "T_cam_obj"_a,
        "noise_m"_a, "systematic_m"_a,
        "Size (log scale, own and shared variance, pull, unexplained) and form (strain, own and shared "
        "covariance, axis, log stretch, sd) by the depth of one frame; each None where it says nothing.");
  m.def("seen_form", &fused_form, "volume"_a, "camera"_a, "depth"_a, "T_cam_obj"_a, "points"_a,
        "tolerance_m"_a,
        "Mean of J J^T where a fused shape is read, the least slope of a form; points and normals (n, 6).");
}

}  // namespace sdftrack::bindings
