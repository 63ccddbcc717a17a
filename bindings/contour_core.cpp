// SPDX-License-Identifier: MIT
#include "contour_core.h"

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

}  // namespace sdftrack::bindings
