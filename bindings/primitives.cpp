// SPDX-License-Identifier: MIT
#include <pybind11/eigen.h>

#include <optional>

#include "array.h"
#include "base/parallel.h"
#include "primitives/bounds.h"
#include "primitives/evidence.h"
#include "primitives/fit.h"
#include "primitives/outline.h"
#include "release_gil.h"
#include "solids.h"

namespace sdftrack::bindings {

namespace {

// Measurements and edge pixels of a labelled depth image, or only points; and the known data of the table.
class View {
 public:
  static View of_points(const py::array& points) {
    View out;
    std::size_t n;
    const Vec3d* p = borrow_points(points, &n);
    for (const std::size_t i : primitives::spread_order(n)) out.view.points.push_back(p[i]);
    out.view.pack();
    return out;
  }
  static View of_image(const py::array& depth_m, const py::array& labels, const Camera& camera,
                       int reach_px) {
    View out;
    const ImageView<float> image{borrow<float>(depth_m, "depth", {camera.height, camera.width}), camera.width,
                                 camera.height};
    const auto* label = borrow<std::uint8_t>(labels, "labels", {camera.height, camera.width});
    const ReleaseGil release;
    const std::vector<float> rays = camera.distorted() ? ray_table(camera) : std::vector<float>{};
    const frame::DepthFrame frame{image, nullptr, rays.empty() ? nullptr : rays.data()};
    primitives::LabelledPoints on = primitives::labelled_points(frame, camera, label);
    out.view.points = std::move(on.points), out.view.pixels = std::move(on.pixels);
    out.view.outline = primitives::outline_rays(frame, camera, label, reach_px);
    out.view.along_rays = true;
    out.view.pack();
    return out;
  }
  void set_plane(Vec3d normal, double offset, bool stands) {
    view.has_plane = true, view.stands = stands;
    view.plane = {normal, offset};
  }
  py::array_t<double> points() const {
    return gathered<double>(view.points, {3}, [](const Vec3d& p) { return &p.x; });
  }

  primitives::PrimitiveView view;
};

py::dict fit_dict(const primitives::PrimitiveFit& fit, const primitives::SeedCloud& cloud) {
  py::dict d;
  const int n = primitives::size_count(fit.kind);
  const primitives::PrimitiveSize size = fit.size();
  std::vector<double> lengths;
  std::vector<bool> bounded, far;
  for (int i = 0; i < n; ++i) {
    const auto at = static_cast<std::size_t>(i);
    lengths.push_back(size[at]), bounded.push_back(fit.bounded[at]), far.push_back(fit.far[at]);
  }
  d["kind"] = fit.kind;
  d["T_cam_obj"] = inverse(fit.x.T_obj_cam[0]);
  d["size"] = lengths;
  d["bounded"] = bounded;
  d["far"] = far;
  d["covariance"] = primitives::camera_covariance(fit);
  d["scale"] = fit.scale_m;
  d["rms"] = fit.rms_m;
  d["inliers"] = fit.inliers;
  d["outline"] = fit.outline;
  d["steps"] = fit.steps;
  d["freedom"] = fit.freedom;
  d["diameter"] = cloud.diameter_m;
  return d;
}

// One dict per kind (None if there was no start), with its evidence at the least scale of all kinds.
py::list fit_kinds(const View& self, const std::vector<primitives::PrimitiveKind>& kinds,
                   const primitives::PrimitiveFitOptions& options, const py::object& T_cam_obj,
                   const std::optional<std::vector<double>>& size, int threads) {
  std::optional<primitives::PrimitiveGuess> initial;
  if (!T_cam_obj.is_none()) {
    if (kinds.size() != 1 || !size) throw py::value_error("initial: expected one kind, with its size");
    initial = {inverse(rigid_from(py::array(T_cam_obj), "T_cam_obj")), checked_size(kinds[0], *size)};
  }
  std::vector<primitives::PrimitiveFit> fits(kinds.size());
  std::vector<primitives::KindEvidence> evidence(kinds.size());
  primitives::SeedCloud cloud;
  {
    const ReleaseGil release;
    const primitives::PrimitiveView dense = primitives::without_strays(self.view);
    cloud = primitives::seed_cloud(dense);
    parallel_for(kinds.size(), threads, [&](std::size_t k) {
      fits[k] = primitives::fit_primitive(kinds[k], dense, cloud, options, initial ? &*initial : nullptr);
      primitives::count_inliers(self.view, options, &fits[k]);
    });
    if (fits.size() > 1) evidence = primitives::compare_kinds(fits, dense, options, threads);
  }
  py::list out;
  for (std::size_t k = 0; k < fits.size(); ++k) {
    if (!fits[k].found) {
      out.append(py::none());
      continue;
    }
    py::dict d = fit_dict(fits[k], cloud);
    d["against"] = evidence[k].against;
    d["effective"] = evidence[k].effective;
    out.append(d);
  }
  return out;
}

}  // namespace

void bind_primitives(py::module_& m) {
  py::class_<primitives::PrimitiveFitOptions>(m, "PrimitiveFitOptions")
      .def(py::init<>())
      .def_readwrite("scaling", &primitives::PrimitiveFitOptions::scaling)
      .def_readwrite("seed", &primitives::PrimitiveFitOptions::seed)
      .def_readwrite("tolerance_m", &primitives::PrimitiveFitOptions::tolerance_m);
  py::class_<View>(m, "PrimitiveView",
                   "Depth measurements and edge pixels of an object, for fitting solids of unknown size.")
      .def_static("of_points", &View::of_points, "points"_a)
      .def_static("of_image", &View::of_image, "depth"_a, "labels"_a, "camera"_a, "reach_px"_a = 2)
      .def("set_plane", &View::set_plane, "normal"_a, "offset"_a, "stands"_a)
      .def_property_readonly("points", &View::points)
      .def("fit", &fit_kinds, "kinds"_a, "options"_a, "T_cam_obj"_a = py::none(), "size"_a = py::none(),
           "threads"_a = 0);
}

}  // namespace sdftrack::bindings
