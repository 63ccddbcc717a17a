// SPDX-License-Identifier: MIT
#include "appearance.h"

#include <limits>

#include "appearance/color_model.h"
#include "base/to_int.h"
#include "release_gil.h"
#include "tracking/trust/color_evidence.h"
#include "tracking/trust/smooth_foreground.h"
#include "volume.h"

namespace sdftrack::bindings {

namespace {

appearance::ColorMap projective_from(const py::array& P, const py::array& q, int width, int height) {
  const double* p = borrow<double>(P, "P", {3, 3});
  const double* o = borrow<double>(q, "q", {3});
  return appearance::projective_map({{p[0], p[1], p[2]}, {p[3], p[4], p[5]}, {p[6], p[7], p[8]}},
                                    {o[0], o[1], o[2]}, width, height);
}

py::object find_pixel(const appearance::ColorMap& map, float u, float v, float depth_m) {
  int x, y;
  float depth;
  if (!map.find({u, v}, depth_m, &x, &y, &depth)) return py::none();
  return py::make_tuple(x, y);
}

appearance::ColorCounts counts_from(const py::array& object, const py::array& background,
                                    const py::object& front) {
  const float* f = borrow<float>(object, "object", {appearance::kColorBins});
  const float* b = borrow<float>(background, "background", {appearance::kColorBins});
  appearance::ColorCounts counts;
  for (int i = 0; i < appearance::kColorBins; ++i) {
    const auto k = static_cast<std::size_t>(i);
    counts.object[k] = f[i], counts.background[k] = b[i];
    counts.object_pixels += to_int(f[i]), counts.object_weight += static_cast<double>(f[i]);
    counts.background_pixels += to_int(b[i]);
  }
  if (front.is_none()) return counts;
  const float* h = borrow<float>(front.cast<py::array>(), "front", {appearance::kColorBins});
  counts.front.assign(h, h + appearance::kColorBins);
  for (const float pixels : counts.front) counts.front_pixels += to_int(pixels);
  return counts;
}

py::tuple counts_to(appearance::ColorCounts counts) {
  return py::make_tuple(to_numpy(std::move(counts.object), {appearance::kColorBins}),
                        to_numpy(std::move(counts.background), {appearance::kColorBins}),
                        to_numpy(std::move(counts.front), {appearance::kColorBins}));
}

py::tuple color_counts(const py::array& values, double voxel_m, const Vec3d& origin, const Camera& camera,
                       const py::array& depth_m, const py::object& mask, const py::array& color,
                       const appearance::ColorMap& map, const py::array& T_cam_obj, double padding_m,
                       int budget) {
  if (budget < 1) throw py::value_error("budget: expected 1 or more readings, got " + std::to_string(budget));
  const frame::Shape shape = frame::make_shape(volume_view(values, voxel_m, origin), 1, 1);
  const Rigidd T = rigid_from(T_cam_obj, "T_cam_obj");
  const appearance::ColorImage image = color_view(color, py::cast(map));
  FrameWithRays given(depth_m, mask, camera);
  frame::DepthFrame& frame = given.frame;
  frame.color = &image;
  tracking::ColorReader reader;
  appearance::ColorCounts counts;
  {
    const ReleaseGil release;
    if (frame.mask)
      tracking::count_mask_colors(frame, camera, frame.mask, &reader, &counts);
    else
      tracking::count_colors(frame, camera, shape, {T.R, T * shape.centre_obj}, padding_m, budget,
                             appearance::ColorModel(), &reader, &counts);
  }
  return counts_to(std::move(counts));
}

py::array smooth_foreground(const py::array& at, const py::array& depth_m, const py::array& foreground,
                            int width, float focal_px, float noise_m, const py::object& distance_m) {
  const auto n = static_cast<py::ssize_t>(at.size());
  const int* index = borrow<int>(at, "at", {n});
  const float* z = borrow<float>(depth_m, "depth", {n});
  const float* p = borrow<float>(foreground, "foreground", {n});
  const float* d =
      distance_m.is_none() ? nullptr : borrow<float>(distance_m.cast<py::array>(), "distance", {n});
  constexpr int kMostPixels = 1 << 28;  // keeps sums of a row and a width in range
  if (width < 1 || width > kMostPixels) throw py::value_error("width: expected 1 or more pixels of a row");
  for (py::ssize_t i = 0; i < n; ++i)
    if (index[i] < (i ? index[i - 1] : 0) || index[i] > kMostPixels)
      throw py::value_error("at: expected places of pixels, ascending from 0");
  energies::PixelSet pixels;
  for (py::ssize_t i = 0; i < n; ++i) pixels.push(0, 0, z[i], 1, index[i], p[i]);
  tracking::ForegroundSmoother().smooth(width, focal_px, noise_m, d, std::numeric_limits<float>::infinity(),
                                        &pixels);
  return to_numpy(std::move(pixels.foreground), {n});
}

}  // namespace

appearance::ColorImage color_view(const py::object& color, const py::object& map) {
  if (color.is_none()) return {};
  appearance::ColorImage image{nullptr, map.cast<appearance::ColorMap>()};
  image.rgb = borrow<unsigned char>(color.cast<py::array>(), "color", {image.map.height, image.map.width, 3});
  return image;
}

void bind_appearance(py::module_& m) {
  py::class_<appearance::ColorMap>(m, "ColorMap", "Depth pixel to colour pixel; see sdftrack.RGBDCamera.")
      .def_static("aligned", &appearance::aligned_map, "width"_a, "height"_a)
      .def_static(
          "rigid",
          [](const Camera& depth, const Camera& color, const py::array& T_color_depth) {
            return appearance::rigid_map(depth, color, rigid_from(T_color_depth, "T_color_depth"));
          },
          "depth"_a, "color"_a, "T_color_depth"_a)
      .def_static("projective", &projective_from, "P"_a, "q"_a, "width"_a, "height"_a)
      .def_property_readonly(
          "shape", [](const appearance::ColorMap& map) { return py::make_tuple(map.height, map.width); })
      .def("find", &find_pixel, "u_px"_a, "v_px"_a, "depth_m"_a,
           "Colour pixel (x, y) of a depth pixel (its lens removed where the rig is rigid), or None.");
  py::class_<appearance::ColorModel>(m, "ColorModel",
                                     "Histograms of object and background; see docs/math/color.md.")
      .def(py::init<float>(), "prior"_a = 0.7f)
      .def(
          "update",
          [](appearance::ColorModel& self, const py::array& object, const py::array& background,
             double object_rate, double background_rate, const py::object& front) {
            self.update(counts_from(object, background, front), object_rate, background_rate);
          },
          "object"_a, "background"_a, "object_rate"_a = 0.05, "background_rate"_a = 0.3,
          "front"_a = py::none(), "Mix in the counts of one frame, (4096,) float32 each.")
      .def_property_readonly("known", &appearance::ColorModel::known)
      .def_property_readonly("overlap", &appearance::ColorModel::overlap)
      .def_property_readonly("posterior", [](const appearance::ColorModel& self) {
        return to_numpy(std::vector<float>(self.posterior()),
                        {static_cast<py::ssize_t>(self.posterior().size())});
      });
  m.def("color_counts", &color_counts, "values"_a, "voxel_size"_a, "origin"_a, "camera"_a, "depth"_a,
        "mask"_a, "color"_a, "color_map"_a, "T_cam_obj"_a, "padding_m"_a, "budget"_a,
        "Colours on the object, around it and in front of it, (4096,) float32 each: at the pose, or by the "
        "mask if given.");
  m.def("smooth_foreground", &smooth_foreground, "at"_a, "depth"_a, "foreground"_a, "width"_a, "focal_px"_a,
        "noise_m"_a, "distance"_a = py::none(),
        "Posteriors (N,) float32 of pixels, smoothed over the image; distance: from the surface, or None.");
}

}  // namespace sdftrack::bindings
