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
        const std::vector<Rigidd> motions = symmetry_from(discrete, axes).motions(steps);
        py::array_t<double> out({static_cast<py::ssize_t>(motions.size()), py::ssize_t{4}, py::ssize_t{4}});
        double* to = out.mutable_data();
        for (const Rigidd& S : motions) write_matrix(S, to), to += 16;
        return out;
      },
      py::arg("discrete"), py::arg("axes"), py::arg("steps"), "Symmetry.motions: (n, 4, 4).");
  m.def(
      "canonical_pose",
      [](const py::array& discrete, const py::array& axes, const py::array& T, const py::array& near) {
        const Rigidd found = symmetry_from(discrete, axes)
                                 .canonical(read_matrix(borrow<double>(T, "T", {4, 4})),
                                            read_matrix(borrow<double>(near, "near", {4, 4})).R);
        py::array_t<double> out({4, 4});
        write_matrix(found, out.mutable_data());
        return out;
      },
      py::arg("discrete"), py::arg("axes"), py::arg("T"), py::arg("near"), "Symmetry.canonical: (4, 4).");
}

}  // namespace sdftrack::bindings
