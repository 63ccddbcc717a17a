// SPDX-License-Identifier: MIT
#include "contour_options.h"

#include "contour/option_schema.h"
#include "option_binding.h"

namespace sdftrack::bindings {

contour::RgbView color_view(const py::array& image) {
  const unsigned char* rgb = borrow<unsigned char>(image, "image", {-1, -1, 3});
  return {rgb, static_cast<int>(image.shape(1)), static_cast<int>(image.shape(0))};
}

std::optional<contour::FlowView> flow_view(const std::optional<py::array>& flow, int x0, int y0,
                                           const contour::RgbView& image) {
  if (!flow) return std::nullopt;
  const float* back = borrow<float>(*flow, "flow", {-1, -1, 2});
  const auto height = static_cast<int>(flow->shape(0)), width = static_cast<int>(flow->shape(1));
  if (x0 < 0 || y0 < 0 || width > image.width - x0 || height > image.height - y0)
    throw std::invalid_argument("flow: expected that of a part of the image");
  return contour::FlowView{back, {x0, y0, x0 + width, y0 + height}};
}

contour::ContourOptions options_from(const py::dict& given) {
  const py::object options = py::cast(contour::ContourOptions{});
  for (const auto& [name, value] : given) {
    if (!py::hasattr(options, name))
      throw std::invalid_argument("options: expected options of ContourTracker, got \"" +
                                  py::cast<std::string>(name) + "\"");
    py::setattr(options, name, value);
  }
  const auto out = py::cast<contour::ContourOptions>(options);
  out.check();
  return out;
}

py::dict options_of(const contour::ContourOptions& o) {
  py::dict out;
  for (const OptionDescription& option : describe_options(o)) out[option.name.c_str()] = option.value;
  return out;
}

void bind_contour_options(py::module_& m) {
  bind_options<contour::ContourOptions>(m, "ContourOptions",
                                        "Options of the contour tracker; see st.contour.ContourTracker.");
  m.def(
      "contour_options", [] { return options_of(contour::ContourOptions{}); },
      "The defaults of ContourTracker.");
}

}  // namespace sdftrack::bindings
