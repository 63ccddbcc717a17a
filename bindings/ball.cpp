// SPDX-License-Identifier: MIT
// The ball of a depth-to-colour registration in both images.
#include <pybind11/eigen.h>

#include "array.h"
#include "calibration/ball/ball_color.h"
#include "calibration/registration/recording.h"
#include "release_gil.h"
#include "volume.h"

namespace sdftrack::bindings {

namespace {

using calibration::BallColor, calibration::BallFinder, calibration::DepthBall, calibration::ObservedFrame,
    calibration::Outline, calibration::RgbImage;

RgbImage rgb_view(const py::array& color) {
  const auto* data = borrow<unsigned char>(color, "color", {-1, -1, 3});
  return {reinterpret_cast<const calibration::Rgb*>(data), static_cast<int>(color.shape(1)),
          static_cast<int>(color.shape(0))};
}

std::vector<RgbImage> rgb_views(const std::vector<py::array>& colors) {
  std::vector<RgbImage> out;
  for (const py::array& color : colors) {
    out.push_back(rgb_view(color));
    if (out.back().width != out[0].width || out.back().height != out[0].height)
      throw py::value_error("frames: expected colour images of one size");
  }
  return out;
}

frame::PixelMask mask_from(const py::array& mask) {
  const auto* data = borrow<unsigned char>(mask, "mask", {-1, -1});
  frame::PixelMask out(static_cast<int>(mask.shape(1)), static_cast<int>(mask.shape(0)));
  for (std::size_t i = 0; i < out.on.size(); ++i) out.on[i] = data[i] != 0;
  return out;
}

py::array_t<double> array_of(Vec3d v) { return to_numpy(std::vector<double>{v.x, v.y, v.z}, {3}); }

py::array_t<unsigned char> mask_of(const BallColor& self, const py::array& color) {
  const RgbImage image = rgb_view(color);
  return to_numpy(unlocked([&] { return self.mask(image).on; }), {image.height, image.width});
}

void learn(BallColor& self, const std::vector<py::array>& colors, const Camera& camera, std::uint64_t seed) {
  const std::vector<RgbImage> images = rgb_views(colors);
  const ReleaseGil release;
  self.learn(images, camera, seed);
}

BallColor moving(const std::vector<py::array>& colors) {
  const std::vector<RgbImage> images = rgb_views(colors);
  if (images.empty()) throw py::value_error("frames: expected at least one, got none");
  const ReleaseGil release;
  return BallColor(calibration::moving_color(images));
}

std::vector<DepthBall> search(const BallFinder& self, const py::array& depth, const py::object& given) {
  const ImageView<float> image = image_view(depth, "depth", self.camera());
  const float* const given_m = given_view(given, self.camera());
  const ReleaseGil release;
  return self.search(image, given_m);
}

py::object fit(const BallFinder& self, const py::array& depth, const Vec3d& start) {
  const ImageView<float> image = image_view(depth, "depth", self.camera());
  const std::optional<DepthBall> found = unlocked([&] { return self.fit(image, nullptr, start); });
  return found ? py::cast(*found) : py::none();
}

std::vector<Outline> outlines(const py::array& color, const py::array& mask, const Camera& camera,
                              std::uint64_t seed, std::size_t most) {
  const RgbImage image = rgb_view(color);
  const frame::PixelMask there = mask_from(mask);
  if (there.width != image.width || there.height != image.height)
    throw py::value_error("mask: expected the size of the colour image");
  const ReleaseGil release;
  return calibration::find_outlines(image, there, camera, seed, most);
}

py::array_t<double> edges_of(const Outline& self) {
  return gathered<double>(self.edges_px, {2}, [](const Vec2d& p) { return &p.x; });
}

py::object center_of(const Outline& self, const Camera& camera) {
  const std::optional<calibration::Cone> cone = self.cone(camera);
  if (!cone) return py::none();
  return py::make_tuple(to_numpy(std::vector<double>{cone->center_px.x, cone->center_px.y}, {2}),
                        Eigen::Matrix2d(cone->covariance_px));
}

}  // namespace

void bind_ball(py::module_& m) {
  py::class_<BallColor>(m, "BallColor", "Chromaticity model of a ball.")
      .def(py::init<const Vec3d&>(), "color"_a)
      .def_property_readonly("color", [](const BallColor& self) { return array_of(self.color()); })
      .def("mask", &mask_of, "color"_a, "(h, w) uint8: pixels more likely the ball's than not.")
      .def("learn", &learn, "colors"_a, "camera"_a, "seed"_a,
           "Relearns the model inside the outlines found with it.");
  m.def("moving_color", &moving, "colors"_a, "The most saturated colour among pixels that change.");
  py::class_<Outline>(m, "BallOutline", "A ball's outline in a colour image.")
      .def_property_readonly("edges_px", &edges_of)
      .def_readonly("rms_px", &Outline::rms_px)
      .def_readonly("radius_px", &Outline::radius_px)
      .def("center", &center_of, "camera"_a,
           "Image of the ball's centre (px) and its covariance; None where the edges make no cone.");
  m.def("find_outlines", &outlines, "color"_a, "mask"_a, "camera"_a, "seed"_a = 0, "most"_a = 3);
  m.def(
      "too_small_radius_px",
      [](const py::array& mask) { return calibration::too_small_radius_px(mask_from(mask)); }, "mask"_a);
  py::class_<DepthBall>(m, "DepthBall", "A ball in a depth image.")
      .def_property_readonly("center_cam", [](const DepthBall& b) { return array_of(b.center_cam); })
      .def_readonly("covariance", &DepthBall::covariance)
      .def_readonly("noise_m", &DepthBall::noise_m)
      .def_readonly("pixels", &DepthBall::pixels)
      .def_readonly("share", &DepthBall::share);
  py::class_<BallFinder>(m, "BallFinder", "Finds a ball of known radius in depth images.")
      .def(py::init<const Camera&, double>(), "camera"_a, "radius_m"_a)
      .def("fit", &fit, "depth"_a, "start_cam"_a,
           "A DepthBall near a start (m); None where the measurements are not of a ball.")
      .def("search", &search, "depth"_a, "given"_a = py::none(), "The most completely visible first.");
  py::class_<ObservedFrame>(m, "ObservedFrame", "Candidates of the ball in a frame's two images.")
      .def(py::init([](std::int64_t index, double time_s, const std::vector<DepthBall>& balls,
                       const std::vector<Outline>& outlines) {
             return ObservedFrame{index, time_s, balls, outlines};
           }),
           "index"_a, "time_s"_a, "balls"_a, "outlines"_a)
      .def_readonly("index", &ObservedFrame::index)
      .def_readonly("time_s", &ObservedFrame::time_s)
      .def_readonly("balls", &ObservedFrame::balls)
      .def_readonly("outlines", &ObservedFrame::outlines);
}

}  // namespace sdftrack::bindings
