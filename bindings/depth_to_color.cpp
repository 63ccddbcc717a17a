// SPDX-License-Identifier: MIT
// The map from depth to colour, and its fit to the ball of a recording.
#include <pybind11/eigen.h>

#include "array.h"
#include "calibration/registration/first_map.h"
#include "calibration/registration/recording.h"
#include "release_gil.h"

namespace sdftrack::bindings {

namespace {

using calibration::BallPair, calibration::BallPairs, calibration::BallRecording, calibration::DepthToColor,
    calibration::MapFit;

py::dict as_dict(const BallPairs& pairs) {
  return py::dict(
      "index"_a = gathered<std::int64_t>(pairs, {}, [](const BallPair& p) { return p.index; }),
      "center_cam"_a = gathered<double>(pairs, {3}, [](const BallPair& p) { return &p.center_cam.x; }),
      "center_covariance"_a =
          gathered<double>(pairs, {3, 3}, [](const BallPair& p) { return p.center_covariance.data(); }),
      "color_px"_a = gathered<double>(pairs, {2}, [](const BallPair& p) { return &p.color_px.x; }),
      "color_covariance"_a =
          gathered<double>(pairs, {2, 2}, [](const BallPair& p) { return p.color_covariance.data(); }),
      "radius_px"_a = gathered<double>(pairs, {}, [](const BallPair& p) { return p.radius_px; }),
      "time_s"_a = gathered<double>(pairs, {}, [](const BallPair& p) { return p.time_s; }));
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
  return py::dict(
      "map"_a = fit.map, "offset_s"_a = fit.offset_s, "covariance"_a = fit.covariance,
      "residual_px"_a = gathered<double>(fit.residual_px, {2}, [](const Vec2d& r) { return &r.x; }),
      "kept"_a = gathered<bool>(fit.kept, {}, [](std::uint8_t kept) { return kept != 0; }),
      "freedom"_a = fit.freedom);
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
  return py::make_tuple(found->K, found->T_color_depth);
}

py::object fit_pairs(const py::array& center, const py::array& center_covariance, const py::array& px,
                     const py::array& px_covariance, const py::array& time, const py::object& color,
                     bool time_offset, std::uint64_t seed) {
  const BallPairs pairs = pairs_from(center, center_covariance, px, px_covariance, time);
  const Camera* const camera = color.is_none() ? nullptr : color.cast<const Camera*>();
  std::optional<MapFit> fit =
      unlocked([&] { return calibration::first_map(pairs, camera, time_offset, seed); });
  return fit ? py::object(as_dict(*fit)) : py::none();
}

py::object registered(const BallRecording& self, const Camera& color, bool known, bool time_offset,
                      std::uint64_t seed) {
  std::optional<calibration::Registration> found =
      unlocked([&] { return self.registered(color, known, time_offset, seed); });
  return found ? py::object(py::make_tuple(as_dict(found->fit), as_dict(found->pairs))) : py::none();
}

}  // namespace

void bind_depth_to_color(py::module_& m) {
  py::class_<DepthToColor>(m, "DepthToColor", "A map from points of a depth camera to colour pixels.")
      .def_static(
          "projective", [](const calibration::ProjectiveMatrix& M) { return DepthToColor(M); }, "M"_a)
      .def_static(
          "rigid",
          [](const py::array& T, const Camera& color) {
            return DepthToColor(rigid_from(T, "T_color_depth"), color);
          },
          "T_color_depth"_a, "color"_a)
      .def_property_readonly("M", [](const DepthToColor& self) { return self.M(); })
      .def_property_readonly("T_color_depth", [](const DepthToColor& self) { return self.T_color_depth(); })
      .def("predict", &predict, "points"_a, "Pixels (N, 2) and derivatives by the unknowns (N, 2, n).")
      .def("Pq", &Pq, "depth"_a, "P, q and the derivatives (12, n) of (P row by row, q).");
  m.def("decompose_map", &decomposed, "M"_a, "K' and T_color_depth of M = K' [R' | t].");
  m.def("fit_color_map", &fit_pairs, "center_cam"_a, "center_covariance"_a, "color_px"_a,
        "color_covariance"_a, "time_s"_a, "color"_a, "time_offset"_a, "seed"_a);
  m.attr("MIN_BALL_RADIUS_PX") = calibration::kMinRadius_px;
  m.attr("BALL_BAND_PX") = calibration::kBand_px;
  py::class_<BallRecording>(m, "BallRecording", "The ball in the frames of a recording.")
      .def(py::init<>())
      .def("add", &BallRecording::add, "frame"_a)
      .def_property_readonly("frames", &BallRecording::frames)
      .def("sort_moving_first", &BallRecording::sort_moving_first, "radius_m"_a)
      .def(
          "pairs", [](const BallRecording& self, const Camera& color) { return as_dict(self.pairs(color)); },
          "color"_a)
      .def("registered", &registered, "color"_a, "known"_a, "time_offset"_a, "seed"_a);
}

}  // namespace sdftrack::bindings
