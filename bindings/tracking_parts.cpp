// SPDX-License-Identifier: MIT
// Parts of the tracker by themselves: the connected region of a depth image, for the command line, and how
// many residuals share an error, for experiments.
#include "array.h"
#include "pixel_mask.h"
#include "release_gil.h"
#include "tracking/fit/correlation.h"
#include "tracking/start/connected_region.h"
#include "volume.h"

namespace sdftrack::bindings {

namespace {

py::array_t<bool> connected_region(const py::array& depth, const Camera& camera, const py::object& rays,
                                   const std::array<double, 2>& px, double reach_m) {
  const frame::DepthFrame frame = depth_frame(depth, camera, rays);
  frame::PixelMask region = unlocked([&] {
    return tracking::connected_region(frame, camera, {px[0], px[1]}, reach_m);
  });
  return mask_to_numpy(region);
}

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

}  // namespace

void bind_tracking_parts(py::module_& m) {
  m.def("connected_region", &connected_region, "depth"_a, "camera"_a, "rays"_a, "px"_a, "reach_m"_a);
  m.def("correlation_area", &correlation_area, "u_px"_a, "v_px"_a, "residual_m"_a, "scale_m"_a,
        "outlier_floor"_a, "Number of pixels that share one error; 0: too few to estimate it.");
}

}  // namespace sdftrack::bindings
