// SPDX-License-Identifier: MIT
// The private extension module: thin, checked, typed. The public face is python/sdftrack/*.py.
#include <pybind11/pybind11.h>

#include "array.h"
#include "release_gil.h"

namespace sdftrack::bindings {

void bind_base(py::module_& m);
void bind_calibration(py::module_& m);
void bind_contour(py::module_& m);
void bind_device(py::module_& m);
void bind_dlpack(py::module_& m);
void bind_appearance(py::module_& m);
void bind_energies(py::module_& m);
void bind_frame_energy(py::module_& m);
void bind_tracking(py::module_& m);
void bind_levelset(py::module_& m);
void bind_lwpr(py::module_& m);
void bind_photometric(py::module_& m);
void bind_option_schema(py::module_& m);
void bind_plane(py::module_& m);
void bind_primitives(py::module_& m);
void bind_reconstruction(py::module_& m);
void bind_search(py::module_& m);
void bind_render(py::module_& m);
void bind_sdf(py::module_& m);
void bind_superpixels(py::module_& m);
void bind_build(py::module_& m);

}  // namespace sdftrack::bindings

PYBIND11_MODULE(_core, m) {
  m.doc() = "Private core of sdftrack; use the names of the package sdftrack.";
  m.attr("__version__") = SDFTRACK_VERSION;
  sdftrack::watch_for_the_end();
  sdftrack::bind_base(m);
  sdftrack::bind_device(m);
  sdftrack::bind_dlpack(m);
  sdftrack::bind_appearance(m);
  sdftrack::bind_energies(m);
  sdftrack::bind_tracking(m);
  sdftrack::bind_levelset(m);
  sdftrack::bind_lwpr(m);
  sdftrack::bind_photometric(m);
  sdftrack::bind_plane(m);
  sdftrack::bind_primitives(m);
  sdftrack::bind_reconstruction(m);
  sdftrack::bind_search(m);
  sdftrack::bind_frame_energy(m);
  sdftrack::bind_render(m);
  sdftrack::bind_sdf(m);
  sdftrack::bind_calibration(m);
  sdftrack::bind_contour(m);
  sdftrack::bind_superpixels(m);
  sdftrack::bind_option_schema(m);
  sdftrack::bind_build(m);
}
