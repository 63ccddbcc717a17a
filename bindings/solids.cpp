// SPDX-License-Identifier: MIT
#include "solids.h"

#include <pybind11/native_enum.h>

#include "primitives/outline.h"
#include "primitives/residuals.h"

namespace sdftrack::bindings {

primitives::PrimitiveSize checked_size(primitives::PrimitiveKind kind, const std::vector<double>& size) {
  if (static_cast<int>(size.size()) != primitives::size_count(kind))
    throw py::value_error("size: expected " + std::to_string(primitives::size_count(kind)) + " sizes, got " +
                          std::to_string(size.size()));
  primitives::PrimitiveSize out;
  out.fill(1);
  for (std::size_t i = 0; i < size.size(); ++i) {
    if (!(size[i] > 0) || !std::isfinite(size[i]))
      throw py::value_error("size: expected lengths above 0 m, got " + std::to_string(size[i]));
    if (!primitives::is_length(kind, static_cast<int>(i)) &&
        (size[i] < sdf::kLeastExponent || size[i] > sdf::kMostExponent))
      throw py::value_error("size: expected exponents of 0.1 to 2, got " + std::to_string(size[i]));
    out[i] = size[i];
  }
  return out;
}

const Vec3d* borrow_points(const py::array& points, std::size_t* n) {
  const auto* p = reinterpret_cast<const Vec3d*>(borrow<double>(points, "points", {-1, 3}));
  *n = static_cast<std::size_t>(points.shape(0));
  return p;
}

namespace {

primitives::PrimitiveField field_of(primitives::PrimitiveKind kind, primitives::Scaling scaling,
                                    const Rigidd& T_obj_cam, const primitives::PrimitiveSize& size) {
  primitives::PrimitiveField field{kind, scaling, T_obj_cam, {}};
  std::copy(size.begin(), size.end(), field.size_m);
  return field;
}

// phi (N,), d phi / d p (N, 3), d phi / d size (N, sizes), object frame.
py::tuple distances(primitives::PrimitiveKind kind, const std::vector<double>& size, const py::array& points,
                    primitives::Scaling scaling) {
  const primitives::PrimitiveSize s = checked_size(kind, size);
  std::size_t n;
  const Vec3d* p = borrow_points(points, &n);
  const auto sizes = static_cast<std::size_t>(primitives::size_count(kind));
  std::vector<double> phi(n), grad(3 * n), by_size(sizes * n);
  const primitives::PrimitiveField field = field_of(kind, scaling, {}, s);
  for (std::size_t i = 0; i < n; ++i) {
    const primitives::AnySample<double> at = field.sample(p[i]);
    phi[i] = at.phi_m;
    grad[3 * i] = at.grad.x, grad[3 * i + 1] = at.grad.y, grad[3 * i + 2] = at.grad.z;
    for (std::size_t k = 0; k < sizes; ++k) by_size[sizes * i + k] = at.size[k];
  }
  const auto rows = static_cast<py::ssize_t>(n);
  return py::make_tuple(to_numpy(std::move(phi), {rows}), to_numpy(std::move(grad), {rows, 3}),
                        to_numpy(std::move(by_size), {rows, static_cast<py::ssize_t>(sizes)}));
}

// For one ray of the image's edge: least phi along it (m), and its derivative by (v, w) and the lengths.
py::tuple clearance_of(primitives::PrimitiveKind kind, const std::vector<double>& size,
                       const py::array& T_obj_cam, Vec3d ray, double near_m, double far_m) {
  const primitives::PrimitiveSize s = checked_size(kind, size);
  const primitives::PrimitiveField field =
      field_of(kind, primitives::Scaling::kExact, rigid_from(T_obj_cam, "T_obj_cam"), s);
  primitives::SolidResidual r;
  primitives::clearance(field, {ray, near_m, far_m, 0, primitives::Sight::kOn}, &r);
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
                        "unknowns"_a = kind.unknowns, "has_inside"_a = kind.inside,
                        "in_auto"_a = kind.in_auto));
  }
  return out;
}

void bind_kinds(py::module_& m) {
  py::native_enum<primitives::PrimitiveKind> kinds(m, "PrimitiveKind", "enum.Enum");
  for (int k = 0; k < primitives::kPrimitiveKinds; ++k) {
    const auto kind = static_cast<primitives::PrimitiveKind>(k);
    kinds.value(primitives::facts(kind).name, kind);
  }
  kinds.finalize();
  m.def("primitive_kinds", &primitive_kinds, "What each kind of primitive is; see primitives/kinds.py.");
}

}  // namespace

void bind_solids(py::module_& m) {
  bind_kinds(m);
  py::native_enum<primitives::Scaling>(m, "Scaling", "enum.Enum")
      .value("exact", primitives::Scaling::kExact)
      .value("printed", primitives::Scaling::kPrinted)
      .finalize();
  m.def("primitive_distances", &distances, "kind"_a, "size"_a, "points"_a,
        py::arg_v("scaling", primitives::Scaling::kExact, "Scaling.exact"),
        "-> phi (N,), gradient (N, 3), derivative by every size (N, sizes).");
  m.def("primitive_clearance", &clearance_of, "kind"_a, "size"_a, "T_obj_cam"_a, "ray"_a, "near_m"_a,
        "far_m"_a, "-> least phi along a stretch of a ray (m), derivative by (v, w) and every size.");
  m.def(
      "primitive_reach",
      [](primitives::PrimitiveKind kind, const std::vector<double>& size, Vec3d v) {
        const primitives::Reach r = primitives::reach_of(kind, v, checked_size(kind, size));
        return py::make_tuple(r.reach_m, r.at,
                              std::vector<double>(r.size, r.size + primitives::size_count(kind)));
      },
      "kind"_a, "size"_a, "direction"_a, "-> reach (m), point, derivative by every size.");
}

}  // namespace sdftrack::bindings
