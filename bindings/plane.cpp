// SPDX-License-Identifier: MIT
#include "plane/plane.h"

#include "array.h"
#include "plane/plane_mask.h"
#include "release_gil.h"
#include "volume.h"

namespace sdftrack::bindings {

namespace {

constexpr int kMaskedRounds = 6;
constexpr const char* kMiss[] = {"", "few readings", "no start", "start not flat", "small"};

plane::PlaneMethod method_of(const std::string& name) {
  if (name == "printed") return plane::PlaneMethod::kPrinted;
  if (name == "rigid") return plane::PlaneMethod::kRigid;
  if (name == "bent") return plane::PlaneMethod::kBent;
  throw std::invalid_argument("method: expected \"rigid\", \"bent\" or \"printed\", got \"" + name + "\"");
}

// (mask, normal, offset, bend, noise scale, share), or a word for the reason why there is no plane.
py::object remove_plane(const py::array& depth, const Camera& camera, const py::object& rays, int start_x,
                        int start_y, double tolerance_m, const std::string& method, const Vec3d& noise,
                        bool measure_noise, bool feet, int threads) {
  const frame::DepthFrame frame = depth_frame(depth, camera, rays);
  if (start_x >= camera.width || start_y >= camera.height || (start_x >= 0 && start_y < 0))
    throw py::value_error("start: expected a pixel of the image, or a negative column for none");
  plane::PlaneOptions options{tolerance_m, start_x,           start_y,
                              {},          method_of(method), {noise.x, noise.y, noise.z}};
  py::array_t<bool> mask({camera.height, camera.width});
  auto* out = reinterpret_cast<unsigned char*>(mask.mutable_data());
  plane::FoundPlane found;
  {
    const ReleaseGil release;
    found = plane::search_plane(frame, camera, options);
    if (found.miss == plane::PlaneMiss::kNone) {
      const bool printed = options.method == plane::PlaneMethod::kPrinted;
      const double scale = printed ? 0.0 : measure_noise ? found.noise_scale : 1.0;
      plane::mask_plane(frame, camera, found.plane, {tolerance_m, options.noise, scale, feet && !printed},
                        threads, out);
    }
  }
  if (found.miss != plane::PlaneMiss::kNone) return py::str(kMiss[static_cast<int>(found.miss)]);
  const frame::Plane plane = plane::normal_form(found.plane);
  return py::make_tuple(mask, plane.normal_cam, plane.offset_m, found.plane.bend, found.noise_scale,
                        found.share);
}

// (normal, offset, bend, noise scale) of a plane refitted to all depths in a mask, or None if they lie on a
// line.
py::object fit_masked_plane(const py::array& depth, const Camera& camera, const py::object& rays,
                            const py::object& mask, const Vec3d& normal, double offset_m, double tolerance_m,
                            const Vec3d& noise, bool bent) {
  const frame::DepthFrame frame = depth_frame(depth, camera, rays);
  const unsigned char* requested = mask_view(mask, camera);
  const plane::DepthNoise law{noise.x, noise.y, noise.z};
  plane::InversePlane plane;
  plane.g = (-1 / offset_m) * normal;
  double scale = 1;
  bool fitted = false;
  {
    const ReleaseGil release;
    std::vector<plane::PlaneReading> readings;
    for (int y = 0; y < camera.height; ++y)
      for (int x = 0; x < camera.width; ++x)
        if (!requested || requested[static_cast<std::ptrdiff_t>(y) * camera.width + x]) {
          const plane::PlaneReading p = plane::plane_reading(frame, camera, x, y);
          if (p.depth_m > 0) readings.push_back(p);
        }
    fitted = plane::fit_plane(readings, plane::plane_ruler(camera, tolerance_m, law), kMaskedRounds,
                              bent ? plane::PlaneStart::kBend : plane::PlaneStart::kRough, &plane, &scale);
  }
  if (!fitted) return py::none();
  const frame::Plane found = plane::normal_form(plane);
  return py::make_tuple(found.normal_cam, found.offset_m, plane.bend, scale);
}

}  // namespace

void bind_plane(py::module_& m) {
  m.def("remove_plane", &remove_plane, "depth"_a, "camera"_a, "rays"_a, "start_x"_a, "start_y"_a,
        "tolerance_m"_a, "method"_a, "noise"_a, "measure_noise"_a, "feet"_a, "threads"_a,
        "Mask of what is not on the dominant plane, normal, offset, bend, noise over the law's and share of "
        "the "
        "readings; or one of \"few readings\", \"no start\", \"start not flat\", \"small\".");
  m.def("fit_plane", &fit_masked_plane, "depth"_a, "camera"_a, "rays"_a, "mask"_a, "normal"_a, "offset"_a,
        "tolerance_m"_a, "noise"_a, "bent"_a = false,
        "Normal, offset, bend and noise over the law's of a plane refitted to the readings in a mask; None "
        "on a "
        "line.");
}

}  // namespace sdftrack::bindings
