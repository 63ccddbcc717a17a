// SPDX-License-Identifier: MIT
#include "appearance.h"

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
}

}  // namespace sdftrack::bindings
