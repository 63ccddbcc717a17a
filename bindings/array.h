// SPDX-License-Identifier: MIT
// numpy arrays across the boundary: borrowed and returned without a copy, and checked, with messages that
// name the argument, the expected value, the given value, and how to fix it.
#pragma once

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <algorithm>
#include <array>
#include <string>
#include <utility>
#include <vector>

#include "base/camera.h"
#include "base/rigid.h"

namespace sdftrack::bindings {

namespace py = pybind11;
using namespace py::literals;

std::string describe(const py::array& a);                       // "float16 (480, 640)"
std::string shape_text(const std::vector<py::ssize_t>& shape);  // "(N, 3)" for {-1, 3}
void check_array(const py::array& a, const py::dtype& dtype, const char* name,
                 const std::vector<py::ssize_t>& shape);

// Borrow a C-contiguous numpy array as const T*. `shape` uses -1 for "any length".
// TypeError: wrong dtype or layout. ValueError: wrong shape. The caller keeps `a` alive.
template <class T>
const T* borrow(const py::array& a, const char* name, const std::vector<py::ssize_t>& shape) {
  check_array(a, py::dtype::of<T>(), name, shape);
  return static_cast<const T*>(a.data());
}

// Passes a vector to numpy without a copy; the array then owns it.
template <class T>
py::array_t<T> to_numpy(std::vector<T> values, std::vector<py::ssize_t> shape) {
  auto* owner = new std::vector<T>(std::move(values));
  py::capsule free_when_done(owner, [](void* p) { delete static_cast<std::vector<T>*>(p); });
  return py::array_t<T>(std::move(shape), owner->data(), free_when_done);
}

// (N, ...) of each item's number, or of its contiguous numbers, of which `of` returns the first one's
// address.
template <class T, class Items, class Of>
py::array_t<T> gathered(const Items& items, std::vector<py::ssize_t> shape, const Of& of) {
  shape.insert(shape.begin(), static_cast<py::ssize_t>(std::size(items)));
  py::array_t<T> out(shape);
  T* to = out.mutable_data();
  const py::ssize_t each = out.size() / std::max<py::ssize_t>(shape[0], 1);
  for (const auto& item : items)
    if constexpr (std::is_pointer_v<decltype(of(item))>)
      to = std::copy_n(of(item), each, to);
    else
      *to++ = static_cast<T>(of(item));
  return out;
}

// What __reduce__ returns: the attributes of these names are the arguments of the constructor.
inline py::tuple reduced(const py::object& self, const std::vector<const char*>& names) {
  py::list values;
  for (const char* name : names) values.append(self.attr(name));
  return py::make_tuple(self.attr("__class__"), py::tuple(values));
}

// Throws ValueError unless (x0, y0, x1, y1) lies within the image; it may be empty.
void check_region(const std::array<int, 4>& region, int width, int height);

// 4x4 float64 to Rigid. A matrix from a float32 file is not exactly rigid: it is projected onto the rotations
// if within 1e-3, and rejected (ValueError) otherwise.
Rigidd rigid_from(const py::array& T, const char* name);
py::array_t<double> matrix_from(const Rigidd& T);
py::array_t<double> matrices_from(const std::vector<Rigidd>& many);  // (N, 4, 4)
// A transform to and from 16 numbers, row by row, unchanged.
void write_matrix(const Rigidd& T, double* m);
Rigidd read_matrix(const double* m);

}  // namespace sdftrack::bindings

namespace pybind11::detail {

// As three numbers.
template <>
struct type_caster<sdftrack::Vec3d> {
  using Numbers = std::array<double, 3>;
  PYBIND11_TYPE_CASTER(sdftrack::Vec3d, make_caster<Numbers>::name);

  bool load(handle from, bool convert) {
    make_caster<Numbers> numbers;
    if (!numbers.load(from, convert)) return false;
    const auto& [x, y, z] = cast_op<const Numbers&>(numbers);
    value = {x, y, z};
    return true;
  }
  static handle cast(const sdftrack::Vec3d& v, return_value_policy policy, handle parent) {
    return make_caster<Numbers>::cast(Numbers{v.x, v.y, v.z}, policy, parent);
  }
};

// A 4x4 array; `rigid_from` reads one.
template <>
struct type_caster<sdftrack::Rigidd> {
  static constexpr auto name = const_name("numpy.typing.NDArray[numpy.float64]");
  static handle cast(const sdftrack::Rigidd& T, return_value_policy, handle) {
    return sdftrack::bindings::matrix_from(T).release();
  }
};

}  // namespace pybind11::detail
