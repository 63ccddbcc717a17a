// SPDX-License-Identifier: MIT
#include "beginning.h"

#include <cmath>

#include "pixel_mask.h"
#include "reconstruction/reconstruction.h"
#include "release_gil.h"
#include "volume.h"

namespace sdftrack::bindings {

namespace {

using reconstruction::Beginning;
using reconstruction::PlaneBelow;

std::vector<PlaneBelow> planes_from(const py::array& planes) {
  const double* p = borrow<double>(planes, "planes", {-1, 5});
  std::vector<PlaneBelow> out;
  for (py::ssize_t k = 0; k < planes.shape(0); ++k, p += 5) out.push_back({{p[0], p[1], p[2]}, p[3], p[4]});
  return out;
}

static_assert(sizeof(PlaneBelow) == 5 * sizeof(double));
py::array_t<double> planes_to_numpy(const std::vector<PlaneBelow>& planes) {
  return gathered<double>(planes, {5}, [](const PlaneBelow& p) { return &p.normal_cam.x; });
}

reconstruction::BeginningOptions beginning_options(const reconstruction::ReconstructionOptions& o) {
  return {o.planes, o.keep_to_mask, o.mask_margin_px, o.noise_m};
}

frame::DepthFrame first_frame(const py::array& depth, const py::object& given, const Camera& camera) {
  frame::DepthFrame frame{image_view(depth, "depth", camera), nullptr, nullptr};
  frame.given_m = given_view(given, camera);
  return frame;
}

Beginning find_object(const py::array& depth, const py::object& given, const py::object& place,
                      const Camera& camera, const std::optional<PyVolume>& initial,
                      const reconstruction::ReconstructionOptions& options) {
  const frame::DepthFrame frame = first_frame(depth, given, camera);
  const tracking::PoseHint hint = pose_hint_from(place, camera);
  const std::optional<reconstruction::KnownShape> shape = known_shape_from(initial);
  const ReleaseGil release;
  return reconstruction::find_object(frame, hint, camera, shape ? &*shape : nullptr,
                                     beginning_options(options));
}

Beginning find_standing(const py::array& depth, const py::object& given, const py::array& T,
                        const Camera& camera, const PyVolume& initial,
                        const reconstruction::ReconstructionOptions& options) {
  const frame::DepthFrame frame = first_frame(depth, given, camera);
  const Rigidd T_cam_obj = rigid_from(T, "T");
  const std::optional<reconstruction::KnownShape> shape = known_shape_from(initial);
  const ReleaseGil release;
  return reconstruction::find_standing(frame, T_cam_obj, camera, *shape, beginning_options(options));
}

// As it was saved.
Beginning beginning_of(const py::array& T, const py::array& on_object, const Vec3d& centre, double radius_m,
                       double behind_m, double shorter_m, double noise_m,
                       const std::optional<py::array>& from_m, const std::optional<py::array>& planes,
                       const std::optional<py::array>& outline) {
  if (on_object.ndim() != 2)
    throw py::value_error("on_object: expected a mask (H, W), got " + describe(on_object));
  const auto h = static_cast<int>(on_object.shape(0)), w = static_cast<int>(on_object.shape(1));
  Beginning out;
  out.T_cam_obj = rigid_from(T, "T"), out.noise_m = noise_m;
  out.on_object = pixel_mask_from(on_object, "on_object", w, h);
  out.ball = {centre, radius_m, behind_m, shorter_m};
  if (from_m && planes) {
    const float* from = borrow<float>(*from_m, "from_m", {h, w});
    out.view = reconstruction::ViewBounds{{from, from + out.on_object.on.size()}, planes_from(*planes)};
  }
  if (outline) out.outline = pixel_mask_from(*outline, "outline", w, h);
  return out;
}

}  // namespace

std::optional<reconstruction::KnownShape> known_shape_from(const std::optional<PyVolume>& shape) {
  if (!shape) return std::nullopt;
  const auto& [values, voxel_m, origin] = *shape;
  const float* phi = borrow<float>(values, "values", {-1, -1, -1});
  return reconstruction::KnownShape{
      grid_from({values.shape(0), values.shape(1), values.shape(2)}, voxel_m, origin), phi};
}

tracking::PoseHint pose_hint_from(const py::object& place, const Camera& camera) {
  tracking::PoseHint where;
  if (place.is_none()) return where;
  if (py::isinstance<py::tuple>(place)) {
    const auto [x, y, w, h] = place.cast<std::tuple<int, int, int, int>>();
    where.box = frame::Rect{x, y, x + w, y + h};
    return where;
  }
  const auto array = place.cast<py::array>();
  if (array.ndim() == 2 && array.shape(0) == 4 && array.shape(1) == 4) {
    where.T_cam_obj = rigid_from(array, "T");
    return where;
  }
  const unsigned char* mask = mask_view(place, camera);
  where.mask.assign(mask, mask + static_cast<std::size_t>(camera.width) * camera.height);
  return where;
}

void bind_beginning(py::module_& m) {
  py::class_<Beginning>(m, "Beginning", "What the first frame of a recording shows of an unknown object.")
      .def(py::init(&beginning_of), "T_cam_obj"_a, "on_object"_a, "centre_cam"_a, "radius_m"_a, "behind_m"_a,
           "shorter_m"_a, "noise_m"_a, "from_m"_a = py::none(), "planes"_a = py::none(),
           "outline"_a = py::none())
      .def("__reduce__",
           [](const py::object& self) {
             return reduced(self, {"T_cam_obj", "on_object", "centre_cam", "radius_m", "behind_m",
                                   "shorter_m", "noise_m", "from_m", "planes", "outline"});
           })
      .def(
          "at_pose",
          [](Beginning self, const py::array& T) {
            self.T_cam_obj = rigid_from(T, "T");
            return self;
          },
          "T_cam_obj"_a, "The same with another pose.")
      .def_property_readonly("T_cam_obj", [](const Beginning& self) { return self.T_cam_obj; })
      .def_property_readonly("on_object", [](const Beginning& self) { return mask_to_numpy(self.on_object); })
      .def_property_readonly("centre_cam", [](const Beginning& self) { return self.ball.centre_cam; })
      .def_property_readonly("radius_m", [](const Beginning& self) { return self.ball.radius_m; })
      .def_property_readonly("behind_m", [](const Beginning& self) { return self.ball.behind_m; })
      .def_property_readonly("shorter_m", [](const Beginning& self) { return self.ball.shorter_m; })
      .def_readonly("noise_m", &Beginning::noise_m)
      .def_property_readonly("from_m",
                             [](const Beginning& self) -> std::optional<py::array_t<float>> {
                               if (!self.view) return std::nullopt;
                               return to_numpy(std::vector<float>(self.view->from_m),
                                               {self.on_object.height, self.on_object.width});
                             })
      .def_property_readonly("planes",
                             [](const Beginning& self) -> std::optional<py::array_t<double>> {
                               if (!self.view) return std::nullopt;
                               return planes_to_numpy(self.view->planes);
                             })
      .def_property_readonly("outline", [](const Beginning& self) -> std::optional<py::array_t<bool>> {
        if (!self.outline) return std::nullopt;
        return mask_to_numpy(*self.outline);
      });
  m.def("find_object", &find_object, "depth"_a, "given"_a, "place"_a, "camera"_a, "initial"_a, "options"_a,
        "The object of a first frame at a mask, a box, or a pose of the initial shape.");
  m.def("find_standing", &find_standing, "depth"_a, "given"_a, "T_cam_obj"_a, "camera"_a, "shape"_a,
        "options"_a, "The same at the pose of a shape, with the planes that it stands on.");
}

}  // namespace sdftrack::bindings
