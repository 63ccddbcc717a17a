// SPDX-License-Identifier: MIT
#include <pybind11/eigen.h>
#include <pybind11/stl.h>

#include <optional>

#include "array.h"
#include "base/parallel.h"
#include "primitives/fit.h"
#include "primitives/outline.h"
#include "primitives/residuals.h"
#include "primitives/solids.h"
#include "release_gil.h"

namespace sdftrack::bindings {

namespace {

using namespace py::literals;

primitives::PrimitiveSize checked_size(primitives::PrimitiveKind kind, const std::vector<double>& size) {
  if (static_cast<int>(size.size()) != primitives::size_count(kind))
    throw py::value_error("size: expected " + std::to_string(primitives::size_count(kind)) +
                          " lengths, got " + std::to_string(size.size()));
  primitives::PrimitiveSize out{1, 1, 1};
  for (std::size_t i = 0; i < size.size(); ++i) {
    if (!(size[i] > 0) || !std::isfinite(size[i]))
      throw py::value_error("size: expected lengths above 0 m, got " + std::to_string(size[i]));
    out[i] = size[i];
  }
  return out;
}

const Vec3d* borrow_points(const py::array& points, std::size_t* n) {
  const auto* p = reinterpret_cast<const Vec3d*>(borrow<double>(points, "points", {-1, 3}));
  *n = static_cast<std::size_t>(points.shape(0));
  return p;
}

// phi (N,), d phi / d p (N, 3), d phi / d size (N, sizes), object frame.
py::tuple distances(primitives::PrimitiveKind kind, const std::vector<double>& size, const py::array& points,
                    primitives::Scaling scaling) {
  const primitives::PrimitiveSize s = checked_size(kind, size);
  std::size_t n;
  const Vec3d* p = borrow_points(points, &n);
  const auto sizes = static_cast<std::size_t>(primitives::size_count(kind));
  std::vector<double> phi(n), grad(3 * n), by_size(sizes * n);
  const primitives::PrimitiveField field{kind, scaling, {}, {s[0], s[1], s[2]}};
  for (std::size_t i = 0; i < n; ++i) {
    const sdf::SolidSample<double> at = field.sample(p[i]);
    phi[i] = at.phi_m;
    grad[3 * i] = at.grad.x, grad[3 * i + 1] = at.grad.y, grad[3 * i + 2] = at.grad.z;
    for (std::size_t k = 0; k < sizes; ++k) by_size[sizes * i + k] = at.size[k];
  }
  const auto rows = static_cast<py::ssize_t>(n);
  return py::make_tuple(to_numpy(std::move(phi), {rows}), to_numpy(std::move(grad), {rows, 3}),
                        to_numpy(std::move(by_size), {rows, static_cast<py::ssize_t>(sizes)}));
}

// Readings and edge pixels of a labelled depth image, or bare points; what is known of the table.
class View {
 public:
  static View of_points(const py::array& points) {
    View out;
    std::size_t n;
    const Vec3d* p = borrow_points(points, &n);
    for (const std::size_t i : primitives::spread_order(n)) out.view.points.push_back(p[i]);
    out.view.bare = primitives::FloatPoints(out.view.points);
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
    out.view.points = primitives::labelled_points(frame, camera, label);
    out.view.outline = primitives::outline_rays(frame, camera, label, reach_px);
    out.view.along_rays = true;
    return out;
  }
  void set_plane(std::array<double, 3> normal, double offset, bool stands) {
    view.has_plane = true, view.stands = stands;
    view.plane = {{normal[0], normal[1], normal[2]}, offset};
  }
  py::array_t<double> points() const {
    std::vector<double> out;
    for (const Vec3d& p : view.points) out.insert(out.end(), {p.x, p.y, p.z});
    return to_numpy(std::move(out), {static_cast<py::ssize_t>(view.points.size()), 3});
  }

  primitives::PrimitiveView view;
};

py::dict fit_dict(const primitives::PrimitiveFit& fit, const primitives::SeedCloud& cloud) {
  py::dict d;
  const int n = primitives::size_count(fit.kind);
  const Rigidd T = inverse(fit.x.T_obj_cam[0]);
  Eigen::MatrixXd J = Eigen::MatrixXd::Zero(6 + n, 6 + n);
  const Vec3d rows[3] = {T.R.r0, T.R.r1, T.R.r2};
  for (int block = 0; block < 6; block += 3)
    for (int i = 0; i < 3; ++i) {
      J(block + i, block) = -rows[i].x, J(block + i, block + 1) = -rows[i].y,
                   J(block + i, block + 2) = -rows[i].z;
    }
  const primitives::PrimitiveSize size = fit.size();
  std::vector<double> lengths;
  std::vector<bool> bounded;
  for (int i = 0; i < n; ++i) {
    const auto at = static_cast<std::size_t>(i);
    J(6 + i, 6 + i) = size[at], lengths.push_back(size[at]), bounded.push_back(fit.bounded[at]);
  }
  d["kind"] = fit.kind;
  d["T_cam_obj"] = matrix_from(T);
  d["size"] = lengths;
  d["bounded"] = bounded;
  d["covariance"] = Eigen::MatrixXd(J * fit.covariance * J.transpose());
  d["scale"] = fit.scale_m;
  d["rms"] = fit.rms_m;
  d["inliers"] = fit.inliers;
  d["outline"] = fit.outline;
  d["steps"] = fit.steps;
  d["freedom"] = fit.freedom;
  d["diameter"] = cloud.diameter_m;
  return d;
}

// One dict per kind (None where there was nothing to start from), with its evidence at the least scale of
// all.
py::list fit_kinds(const View& self, const std::vector<primitives::PrimitiveKind>& kinds,
                   const primitives::PrimitiveFitOptions& options, const py::object& T_cam_obj,
                   const std::optional<std::vector<double>>& size, int threads) {
  std::optional<primitives::PrimitiveGuess> initial;
  if (!T_cam_obj.is_none()) {
    if (kinds.size() != 1 || !size) throw py::value_error("initial: expected one kind, with its size");
    initial = {inverse(rigid_from(py::array(T_cam_obj), "T_cam_obj")), checked_size(kinds[0], *size)};
  }
  std::vector<primitives::PrimitiveFit> fits(kinds.size());
  std::vector<double> against(kinds.size());
  primitives::SeedCloud cloud;
  {
    const ReleaseGil release;
    cloud = primitives::seed_cloud(self.view);
    parallel_for(kinds.size(), threads, [&](std::size_t k) {
      fits[k] = primitives::fit_primitive(kinds[k], self.view, cloud, options, initial ? &*initial : nullptr);
    });
    double scale = 1;  // that all kinds share
    for (const primitives::PrimitiveFit& fit : fits)
      if (fit.found) scale = std::min(scale, fit.scale_m);
    parallel_for(kinds.size(), threads, [&](std::size_t k) {
      if (fits[k].found && fits.size() > 1)
        against[k] = primitives::evidence_against(fits[k], self.view, options, scale);
    });
  }
  py::list out;
  for (std::size_t k = 0; k < fits.size(); ++k) {
    if (!fits[k].found) {
      out.append(py::none());
      continue;
    }
    py::dict d = fit_dict(fits[k], cloud);
    d["against"] = against[k];
    out.append(d);
  }
  return out;
}

// What a test compares: residuals, gradient and cost at a pose and lengths.
py::dict energy_at(const View& self, primitives::PrimitiveKind kind, const py::array& T_obj_cam,
                   const std::vector<double>& size, const primitives::PrimitiveEnergyOptions& options) {
  const primitives::PrimitiveSize s = checked_size(kind, size);
  optim::State x;
  x.T_obj_cam = {rigid_from(T_obj_cam, "T_obj_cam")};
  for (int i = 0; i < primitives::size_count(kind); ++i)
    x.log_size.push_back(std::log(s[static_cast<std::size_t>(i)]));
  primitives::PrimitiveEnergy energy(kind, &self.view, options);
  optim::NormalEquations eq;
  eq.reset(energy.unknowns().size());
  energy.linearize(x, &eq);
  std::vector<double> residuals;
  energy.residuals(x, &residuals);
  py::dict d;
  d["cost"] = eq.cost, d["gradient"] = eq.gradient, d["hessian"] = eq.hessian;
  d["outline_cost"] = energy.outline_cost(x);
  const auto n = static_cast<py::ssize_t>(residuals.size());
  d["residuals"] = to_numpy(std::move(residuals), {n});
  return d;
}

// Of one ray of the picture's edge: least phi along it (m), and its derivative by (v, w) and the lengths.
py::tuple clearance_of(primitives::PrimitiveKind kind, const std::vector<double>& size,
                       const py::array& T_obj_cam, std::array<double, 3> ray, double near_m, double far_m) {
  const primitives::PrimitiveSize s = checked_size(kind, size);
  const primitives::PrimitiveField field{
      kind, primitives::Scaling::kExact, rigid_from(T_obj_cam, "T_obj_cam"), {s[0], s[1], s[2]}};
  primitives::SolidResidual r;
  primitives::clearance(field, {{ray[0], ray[1], ray[2]}, near_m, far_m, 0, primitives::Sight::kOn}, &r);
  std::vector<double> J(r.J, r.J + 6 + primitives::size_count(kind));
  for (std::size_t i = 6; i < J.size(); ++i) J[i] /= s[i - 6];
  return py::make_tuple(r.m, J);
}

// The facts of every kind, as plain data.
py::list primitive_kinds() {
  py::list out;
  for (const primitives::SolidFacts& kind : primitives::kSolidFacts) {
    py::list sizes, size_axes, extent;
    for (const primitives::SolidSize& size : kind.sizes) sizes.append(size.name), size_axes.append(size.axis);
    for (const primitives::SolidAxis& axis : kind.axes) extent.append(py::make_tuple(axis.size, axis.half));
    out.append(py::dict("name"_a = kind.name, "sizes"_a = py::tuple(sizes),
                        "size_axes"_a = py::tuple(size_axes), "extent"_a = py::tuple(extent),
                        "unknowns"_a = kind.unknowns, "has_inside"_a = kind.inside));
  }
  return out;
}

void bind_kinds(py::module_& m) {
  py::enum_<primitives::PrimitiveKind> kinds(m, "PrimitiveKind");
  for (int k = 0; k < primitives::kPrimitiveKinds; ++k) {
    const auto kind = static_cast<primitives::PrimitiveKind>(k);
    kinds.value(primitives::facts(kind).name, kind);
  }
  m.def("primitive_kinds", &primitive_kinds, "What each kind of primitive is; see primitives/kinds.py.");
}

}  // namespace

void bind_primitives(py::module_& m) {
  bind_kinds(m);
  py::enum_<primitives::Scaling>(m, "Scaling")
      .value("exact", primitives::Scaling::kExact)
      .value("printed", primitives::Scaling::kPrinted);
  py::enum_<primitives::Rest>(m, "Rest")
      .value("point", primitives::Rest::kPoint)
      .value("base", primitives::Rest::kBase)
      .value("side", primitives::Rest::kSide);
  py::class_<primitives::PrimitiveFitOptions>(m, "PrimitiveFitOptions")
      .def(py::init<>())
      .def_readwrite("scaling", &primitives::PrimitiveFitOptions::scaling)
      .def_readwrite("seed", &primitives::PrimitiveFitOptions::seed)
      .def_readwrite("max_points", &primitives::PrimitiveFitOptions::max_points)
      .def_readwrite("tolerance_m", &primitives::PrimitiveFitOptions::tolerance_m);
  py::class_<primitives::PrimitiveEnergyOptions>(m, "PrimitiveEnergyOptions")
      .def(py::init<>())
      .def_readwrite("scaling", &primitives::PrimitiveEnergyOptions::scaling)
      .def_readwrite("scale_m", &primitives::PrimitiveEnergyOptions::scale_m)
      .def_readwrite("outlier_floor", &primitives::PrimitiveEnergyOptions::outlier_floor)
      .def_readwrite("outline_scale_px", &primitives::PrimitiveEnergyOptions::outline_scale_px)
      .def_readwrite("outline_floor", &primitives::PrimitiveEnergyOptions::outline_floor)
      .def_readwrite("standing_sigma_m", &primitives::PrimitiveEnergyOptions::standing_sigma_m)
      .def_readwrite("resting_sigma_rad", &primitives::PrimitiveEnergyOptions::resting_sigma_rad)
      .def_readwrite("rest", &primitives::PrimitiveEnergyOptions::rest)
      .def_readwrite("shrink", &primitives::PrimitiveEnergyOptions::shrink)
      .def_readwrite("in_double", &primitives::PrimitiveEnergyOptions::in_double);
  py::class_<View>(m, "PrimitiveView",
                   "Depth measurements and edge pixels of an object, for fitting solids of unknown size.")
      .def_static("of_points", &View::of_points, "points"_a)
      .def_static("of_image", &View::of_image, "depth"_a, "labels"_a, "camera"_a, "reach_px"_a = 2)
      .def("set_plane", &View::set_plane, "normal"_a, "offset"_a, "stands"_a)
      .def_property_readonly("points", &View::points)
      .def_property_readonly("rays", [](const View& v) { return v.view.outline.size(); })
      .def("fit", &fit_kinds, "kinds"_a, "options"_a, "T_cam_obj"_a = py::none(), "size"_a = py::none(),
           "threads"_a = 0)
      .def("energy", &energy_at, "kind"_a, "T_obj_cam"_a, "size"_a, "options"_a);
  m.def("primitive_distances", &distances, "kind"_a, "size"_a, "points"_a,
        py::arg_v("scaling", primitives::Scaling::kExact, "Scaling.exact"),
        "-> phi (N,), gradient (N, 3), derivative by every length (N, sizes).");
  m.def("primitive_clearance", &clearance_of, "kind"_a, "size"_a, "T_obj_cam"_a, "ray"_a, "near_m"_a,
        "far_m"_a, "-> least phi along a stretch of a ray (m), derivative by (v, w) and every length.");
  m.def(
      "primitive_reach",
      [](primitives::PrimitiveKind kind, const std::vector<double>& size, std::array<double, 3> v) {
        const primitives::Reach r = primitives::reach_of(kind, {v[0], v[1], v[2]}, checked_size(kind, size));
        return py::make_tuple(r.reach_m, std::array<double, 3>{r.at.x, r.at.y, r.at.z},
                              std::vector<double>(r.size, r.size + primitives::size_count(kind)));
      },
      "kind"_a, "size"_a, "direction"_a, "-> reach (m), point, derivative by every length.");
}

}  // namespace sdftrack::bindings
