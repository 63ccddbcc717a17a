// SPDX-License-Identifier: MIT
#include "symmetry.h"

namespace sdftrack::bindings {

frame::Symmetry symmetry_from(const py::array& discrete, const py::array& axes) {
  frame::Symmetry out;
  const double* const S = borrow<double>(discrete, "discrete", {-1, 4, 4});
  const double* const a = borrow<double>(axes, "axes", {-1, 2, 3});
  for (py::ssize_t i = 0; i < discrete.shape(0); ++i) out.discrete.push_back(read_matrix(S + 16 * i));
  for (py::ssize_t i = 0; i < 6 * axes.shape(0); i += 6)
    out.axes.push_back({{a[i], a[i + 1], a[i + 2]}, {a[i + 3], a[i + 4], a[i + 5]}});
  return out;
}

void bind_symmetry(py::module_& m) {
  m.attr("SYMMETRY_STEPS") = frame::kSymmetrySteps;
  m.def(
      "symmetry_motions",
      [](const py::array& discrete, const py::array& axes, int steps) {
        return matrices_from(symmetry_from(discrete, axes).motions(steps));
      },
      "discrete"_a, "axes"_a, "steps"_a, "Symmetry.motions: (n, 4, 4).");
  m.def(
      "canonical_pose",
      [](const py::array& discrete, const py::array& axes, const py::array& T, const py::array& near) {
        return symmetry_from(discrete, axes)
            .canonical(read_matrix(borrow<double>(T, "T", {4, 4})),
                       read_matrix(borrow<double>(near, "near", {4, 4})).R);
      },
      "discrete"_a, "axes"_a, "T"_a, "near"_a, "Symmetry.canonical: (4, 4).");
}

}  // namespace sdftrack::bindings
