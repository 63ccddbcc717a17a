// SPDX-License-Identifier: MIT
// The connected region of a depth image, for the command line; parts of a start that tests compare with
// numpy.
#include "appearance.h"
#include "pixel_mask.h"
#include "plane/near_planes.h"
#include "release_gil.h"
#include "tracking/start/click_regions.h"
#include "tracking/start/standing_regions.h"
#include "volume.h"

namespace sdftrack::bindings {

namespace {

using Px = std::array<double, 2>;

py::list mask_arrays(const std::vector<frame::PixelMask>& masks) {
  py::list out;
  for (const frame::PixelMask& mask : masks) out.append(mask_to_numpy(mask));
  return out;
}

py::array_t<bool> connected_region(const py::array& depth, const Camera& camera, const py::object& rays,
                                   const Px& px, double reach_m) {
  const frame::DepthFrame frame = depth_frame(depth, camera, rays);
  frame::PixelMask region = unlocked([&] {
    return tracking::connected_region(frame, camera, {px[0], px[1]}, reach_m);
  });
  return mask_to_numpy(region);
}

// Of every `step`-th pixel of a window x0, y0, x1, y1: (normal, offset, pixels, extent) of each plane.
py::list planes_near(const py::array& depth, const Camera& camera, const py::object& rays,
                     const py::array& around, const std::array<int, 4>& window, int step, double size_m) {
  const frame::DepthFrame frame = depth_frame(depth, camera, rays);
  const unsigned char* chosen = mask_view(around, camera);
  check_region(window, camera.width, camera.height);
  if (step < 1) throw py::value_error("step: expected 1 or more, got " + std::to_string(step));
  std::vector<plane::NearPlane> found;
  {
    const ReleaseGil release;
    const frame::Rect rect{window[0], window[1], window[2], window[3]};
    const frame::PointImage points = frame::points_of(frame, camera, rect, step);
    frame::PixelMask mask = points.measured();
    for (int y = 0; y < mask.height; ++y)
      for (int x = 0; x < mask.width; ++x)
        if (!chosen[static_cast<std::ptrdiff_t>(rect.y0 + step * y) * camera.width + rect.x0 + step * x])
          mask.on[mask.at(x, y)] = 0;
    found = plane::planes_near(points, mask, size_m);
  }
  py::list out;
  for (const plane::NearPlane& one : found) {
    out.append(
        py::make_tuple(one.plane.normal_cam, one.plane.offset_m, mask_to_numpy(one.pixels), one.extent_m));
  }
  return out;
}

py::array_t<bool> joined(const py::array& depth, const py::array& free, const std::array<int, 2>& seed,
                         double step_m) {
  const auto h = static_cast<int>(depth.shape(0)), w = static_cast<int>(depth.shape(1));
  const float* z = borrow<float>(depth, "depth", {-1, -1});
  const frame::PixelMask mask = pixel_mask_from(free, "free", w, h);
  check_region({seed[0], seed[1], seed[0] + 1, seed[1] + 1}, w, h);
  return mask_to_numpy(frame::joined({z, w, h}, mask, {seed[0], seed[1]}, static_cast<float>(step_m),
                                     frame::Neighborhood::kSidesAndCorners));
}

py::tuple nearest_reading(const py::array& depth, const Camera& camera, const Px& px) {
  const tracking::Pixel at =
      tracking::nearest_reading(depth_frame(depth, camera, py::none()), {px[0], px[1]});
  return py::make_tuple(at.y, at.x);
}

py::list click_regions(const py::array& depth, const Camera& camera, const py::object& rays, const Px& px,
                       double size_m, const py::object& color, const py::object& map) {
  frame::DepthFrame frame = depth_frame(depth, camera, rays);
  const appearance::ColorImage image = color_view(color, map);
  if (image.rgb) frame.color = &image;
  return mask_arrays(tracking::click_regions(frame, camera, {px[0], px[1]}, size_m));
}

py::tuple standing_regions(const py::array& depth, const Camera& camera, const py::object& rays,
                           double size_m) {
  const tracking::StandingRegions found =
      tracking::standing_regions(depth_frame(depth, camera, rays), camera, size_m);
  py::list pixels;
  for (const tracking::Pixel at : found.pixels) pixels.append(py::make_tuple(at.x, at.y));
  return py::make_tuple(mask_arrays(found.regions), pixels);
}

}  // namespace

void bind_start_parts(py::module_& m) {
  m.def("connected_region", &connected_region, "depth"_a, "camera"_a, "rays"_a, "px"_a, "reach_m"_a);
  m.def("planes_near", &planes_near, "depth"_a, "camera"_a, "rays"_a, "around"_a, "window"_a, "step"_a,
        "size_m"_a);
  m.def("joined", &joined, "depth"_a, "free"_a, "seed"_a, "step_m"_a);
  m.def("nearest_reading", &nearest_reading, "depth"_a, "camera"_a, "px"_a);
  m.def("click_regions", &click_regions, "depth"_a, "camera"_a, "rays"_a, "px"_a, "size_m"_a,
        "color"_a = py::none(), "color_map"_a = py::none());
  m.def("standing_regions", &standing_regions, "depth"_a, "camera"_a, "rays"_a, "size_m"_a);
}

}  // namespace sdftrack::bindings
