// SPDX-License-Identifier: MIT
// numpy arrays across the boundary: borrowed and returned without a copy, and checked, with messages that
// name the argument, the expected value, the given value, and how to fix it.
#pragma once

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>

#include <array>
#include <string>
#include <utility>
#include <vector>

#include "base/camera.h"
#include "base/rigid.h"

namespace sdftrack::bindings {

namespace py = pybind11;

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

// Throws ValueError unless (x0, y0, x1, y1) lies within the image; it may be empty.
void check_region(const std::array<int, 4>& region, int width, int height);

// 4x4 float64 to Rigid. A matrix from a float32 file is not exactly rigid: it is projected onto the rotations
// if within 1e-3, and rejected (ValueError) otherwise.
Rigidd rigid_from(const py::array& T, const char* name);
py::array_t<double> matrix_from(const Rigidd& T);
// A transform to and from 16 numbers, row by row, unchanged.
void write_matrix(const Rigidd& T, double* m);
Rigidd read_matrix(const double* m);

}  // namespace sdftrack::bindings
