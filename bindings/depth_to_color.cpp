// SPDX-License-Identifier: MIT
// The map from depth to colour, and its fit to the ball of a recording.
#include <pybind11/eigen.h>
#include <pybind11/stl.h>

#include "array.h"
#include "calibration/registration/first_map.h"
#include "calibration/registration/recording.h"
#include "release_gil.h"

namespace sdftrack::bindings {

namespace {

using calibration::BallPair, calibration::BallPairs, calibration::BallRecording, calibration::DepthToColor,
    calibration::MapFit;

py::dict as_dict(const BallPairs& pairs) {
  const auto n = static_cast<py::ssize_t>(pairs.size());
  std::vector<std::int64_t> index;
  std::vector<double> center, center_covariance, px, px_covariance, radius, time;
  for (const BallPair& p : pairs) {
    index.push_back(p.index), radius.push_back(p.radius_px), time.push_back(p.time_s);
    center.insert(center.end(), {p.center_cam.x, p.center_cam.y, p.center_cam.z});
    px.insert(px.end(), {p.color_px.x, p.color_px.y});
    center_covariance.insert(center_covariance.end(), p.center_covariance.data(),
                             p.center_covariance.data() + 9);
    px_covariance.insert(px_covariance.end(), p.color_covariance.data(), p.color_covariance.data() + 4);
  }
  py::dict out;
  out["index"] = to_numpy(std::move(index), {n});
  out["center_cam"] = to_numpy(std::move(center), {n, 3});
  out["center_covariance"] = to_numpy(std::move(center_covariance), {n, 3, 3});
  out["color_px"] = to_numpy(std::move(px), {n, 2});
  out["color_covariance"] = to_numpy(std::move(px_covariance), {n, 2, 2});
  out["radius_px"] = to_numpy(std::move(radius), {n});
  out["time_s"] = to_numpy(std::move(time), {n});
  return out;
}

BallPairs pairs_from(const py::array& center, const py::array& center_covariance, const py::array& px,
                     const py::array& px_covariance, const py::array& time) {
  const py::ssize_t n = center.shape(0);
  const double* c = borrow<double>(center, "center_cam", {-1, 3});
  const double* C = borrow<double>(center_covariance, "center_covariance", {n, 3, 3});
  const double* u = borrow<double>(px, "color_px", {n, 2});
  const double* U = borrow<double>(px_covariance, "color_covariance", {n, 2, 2});
  const double* t = borrow<double>(time, "time_s", {n});
  BallPairs out(static_cast<std::size_t>(n));
  for (std::size_t i = 0; i < out.size(); ++i) {
    out[i].center_cam = {c[3 * i], c[3 * i + 1], c[3 * i + 2]};
    out[i].center_covariance = Eigen::Map<const Eigen::Matrix3d>(C + 9 * i);
    out[i].color_px = {u[2 * i], u[2 * i + 1]};
    out[i].color_covariance = Eigen::Map<const Eigen::Matrix2d>(U + 4 * i);
    out[i].time_s = t[i];
  }
  return out;
}

py::dict as_dict(const MapFit& fit) {
  const auto n = static_cast<py::ssize_t>(fit.kept.size());
  std::vector<double> residual;
  for (const Vec2d r : fit.residual_px) residual.insert(residual.end(), {r.x, r.y});
  py::dict out;
  out["map"] = fit.map;
  out["offset_s"] = fit.offset_s;
  out["covariance"] = fit.covariance;
  out["residual_px"] = to_numpy(std::move(residual), {n, 2});
  out["kept"] = to_numpy(std::vector<std::uint8_t>(fit.kept), {n}).attr("astype")("bool");
  out["freedom"] = fit.freedom;
  return out;
}

// Pixels and their derivatives by the unknowns.
py::tuple predict(const DepthToColor& self, const py::array& points) {
  const double* p = borrow<double>(points, "points", {-1, 3});
  const py::ssize_t n = points.shape(0);
  std::vector<double> px, J;
  for (py::ssize_t i = 0; i < n; ++i) {
    const DepthToColor::Pixel at = self.at({p[3 * i], p[3 * i + 1], p[3 * i + 2]});
    px.insert(px.end(), {at.px.x, at.px.y});
    for (int k = 0; k < 2; ++k)
      for (int j = 0; j < self.unknowns(); ++j) J.push_back(at.by_map(k, j));
  }
  return py::make_tuple(to_numpy(std::move(px), {n, 2}), to_numpy(std::move(J), {n, 2, self.unknowns()}));
}

py::tuple Pq(const DepthToColor& self, const Camera& depth) {
  const DepthToColor::Pq found = self.Pq_of(depth.K);
  Eigen::Matrix3d P;
  for (int i = 0; i < 9; ++i) P(i / 3, i % 3) = found.values[i];
  return py::make_tuple(P, Eigen::Vector3d(found.values.tail<3>()), found.by_map);
}

py::object decomposed(const calibration::ProjectiveMatrix& M) {
  const std::optional<calibration::CameraAndPlace> found = calibration::decompose(M);
  if (!found)
    throw py::value_error(
        "M: expected a mapping of points in front of the camera, got one that mirrors them");
  return py::make_tuple(found->K, matrix_from(found->T_color_depth));
}

py::object fit_pairs(const py::array& center, const py::array& center_covariance, const py::array& px,
                     const py::array& px_covariance, const py::array& time, const py::object& color,
                     bool time_offset, std::uint64_t seed) {
  const BallPairs pairs = pairs_from(center, center_covariance, px, px_covariance, time);
  const Camera* const camera = color.is_none() ? nullptr : color.cast<const Camera*>();
  std::optional<MapFit> fit;
  {
    const ReleaseGil release;
    fit = calibration::first_map(pairs, camera, time_offset, seed);
  }
  return fit ? py::object(as_dict(*fit)) : py::none();
}

py::object registered(const BallRecording& self, const Camera& color, bool known, bool time_offset,
                      std::uint64_t seed) {
  std::optional<calibration::Registration> found;
  {
    const ReleaseGil release;
    found = self.registered(color, known, time_offset, seed);
  }
  return found ? py::object(py::make_tuple(as_dict(found->fit), as_dict(found->pairs))) : py::none();
}

}  // namespace

void bind_depth_to_color(py::module_& m) {
  py::class_<DepthToColor>(m, "DepthToColor", "A map from points of a depth camera to colour pixels.")
      .def_static(
          "projective", [](const calibration::ProjectiveMatrix& M) { return DepthToColor(M); }, py::arg("M"))
      .def_static(
          "rigid",
          [](const py::array& T, const Camera& color) {
            return DepthToColor(rigid_from(T, "T_color_depth"), color);
          },
          py::arg("T_color_depth"), py::arg("color"))
      .def_property_readonly("M", [](const DepthToColor& self) { return self.M(); })
      .def_property_readonly("T_color_depth",
                             [](const DepthToColor& self) { return matrix_from(self.T_color_depth()); })
      .def("predict", &predict, py::arg("points"), "Pixels (N, 2) and derivatives by the unknowns (N, 2, n).")
      .def("Pq", &Pq, py::arg("depth"), "P, q and the derivatives (12, n) of (P row by row, q).");
  m.def("decompose_map", &decomposed, py::arg("M"), "K' and T_color_depth of M = K' [R' | t].");
  m.def("fit_color_map", &fit_pairs, py::arg("center_cam"), py::arg("center_covariance"), py::arg("color_px"),
        py::arg("color_covariance"), py::arg("time_s"), py::arg("color"), py::arg("time_offset"),
        py::arg("seed"));
  m.attr("MIN_BALL_RADIUS_PX") = calibration::kMinRadius_px;
  m.attr("BALL_BAND_PX") = calibration::kBand_px;
  py::class_<BallRecording>(m, "BallRecording", "The ball in the frames of a recording.")
      .def(py::init<>())
      .def("add", &BallRecording::add, py::arg("frame"))
      .def_property_readonly("frames", &BallRecording::frames)
      .def("sort_moving_first", &BallRecording::sort_moving_first, py::arg("radius_m"))
      .def(
          "pairs", [](const BallRecording& self, const Camera& color) { return as_dict(self.pairs(color)); },
          py::arg("color"))
      .def("registered", &registered, py::arg("color"), py::arg("known"), py::arg("time_offset"),
           py::arg("seed"));
}

}  // namespace sdftrack::bindings
