// SPDX-License-Identifier: MIT
#include "array.h"

#include <cmath>

namespace sdftrack::bindings {

std::string shape_text(const std::vector<py::ssize_t>& shape) {
  std::string text = "(";
  for (std::size_t i = 0; i < shape.size(); ++i)
    text += (i ? ", " : "") + (shape[i] < 0 ? std::string("N") : std::to_string(shape[i]));
  return text + (shape.size() == 1 ? ",)" : ")");
}

std::string describe(const py::array& a) {
  return py::str(a.dtype()).cast<std::string>() + " " +
         shape_text(std::vector<py::ssize_t>(a.shape(), a.shape() + a.ndim()));
}

void check_array(const py::array& a, const py::dtype& dtype, const char* name,
                 const std::vector<py::ssize_t>& shape) {
  const auto prefix = [&] { return std::string(name) + ": expected "; };  // only for errors: frames pass here
  const auto type = [&] { return py::str(dtype).cast<std::string>(); };
  if (!a.dtype().is(dtype) && !a.dtype().equal(dtype))
    throw py::type_error(prefix() + type() + ", got " + describe(a) + "; convert with np.ascontiguousarray(" +
                         name + ", np." + type() + ")");
  bool fits = a.ndim() == static_cast<py::ssize_t>(shape.size());
  for (py::ssize_t i = 0; fits && i < a.ndim(); ++i)
    fits = shape[static_cast<std::size_t>(i)] < 0 || a.shape(i) == shape[static_cast<std::size_t>(i)];
  if (!fits) throw py::value_error(prefix() + "shape " + shape_text(shape) + ", got " + describe(a));
  if (!(a.flags() & py::array::c_style))
    throw py::type_error(prefix() + "a C-contiguous array, got strides; convert with np.ascontiguousarray(" +
                         name + ")");
}

void check_region(const std::array<int, 4>& region, int width, int height) {
  if (region[0] < 0 || region[1] < 0 || region[0] > region[2] || region[1] > region[3] || region[2] > width ||
      region[3] > height)
    throw py::value_error("region: expected x0 <= x1, y0 <= y1 within the image of " + std::to_string(width) +
                          " x " + std::to_string(height));
}

Rigidd rigid_from(const py::array& T, const char* name) {
  const double* m = borrow<double>(T, name, {4, 4});
  const std::string prefix = std::string(name) + ": ";
  for (int i = 0; i < 16; ++i)
    if (!std::isfinite(m[i])) throw py::value_error(prefix + "the pose has a value that is not finite");
  if (m[12] != 0 || m[13] != 0 || m[14] != 0 || std::abs(m[15] - 1) > 1e-6)
    throw py::value_error(prefix + "the last row of a rigid transform is 0 0 0 1; is the matrix transposed?");
  const auto [R, t] = read_matrix(m);
  if (orthogonality_error(R) > 1e-2 || determinant(R) <= 0)
    throw py::value_error(prefix + "the upper left 3x3 block is not a rotation (R^T R differs from I by " +
                          std::to_string(orthogonality_error(R)) + ", det " + std::to_string(determinant(R)) +
                          "; at most 0.01 is projected); scale or mirror must be removed first");
  return {nearest_rotation(R), t};
}

void write_matrix(const Rigidd& T, double* m) {
  const Vec3d rows[3] = {T.R.r0, T.R.r1, T.R.r2};
  const double t[3] = {T.t.x, T.t.y, T.t.z};
  for (int i = 0; i < 3; ++i) {
    m[4 * i] = rows[i].x, m[4 * i + 1] = rows[i].y, m[4 * i + 2] = rows[i].z, m[4 * i + 3] = t[i];
    m[12 + i] = 0;
  }
  m[15] = 1;
}

Rigidd read_matrix(const double* m) {
  return {{{m[0], m[1], m[2]}, {m[4], m[5], m[6]}, {m[8], m[9], m[10]}}, {m[3], m[7], m[11]}};
}

py::array_t<double> matrix_from(const Rigidd& T) {
  py::array_t<double> out({4, 4});
  write_matrix(T, out.mutable_data());
  return out;
}

py::array_t<double> matrices_from(const std::vector<Rigidd>& many) {
  py::array_t<double> out({static_cast<py::ssize_t>(many.size()), py::ssize_t{4}, py::ssize_t{4}});
  for (std::size_t k = 0; k < many.size(); ++k) write_matrix(many[k], out.mutable_data() + 16 * k);
  return out;
}

}  // namespace sdftrack::bindings
