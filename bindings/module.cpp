// SPDX-License-Identifier: MIT
// The private extension module: thin, checked, typed. The public face is python/sdftrack/*.py.
#include <pybind11/pybind11.h>

#include <new>
#include <string_view>

#include "array.h"
#include "release_gil.h"

namespace sdftrack::bindings {

void bind_base(py::module_& m);
void bind_ball(py::module_& m);
void bind_depth_errors(py::module_& m);
void bind_depth_to_color(py::module_& m);
void bind_calibration(py::module_& m);
void bind_contour(py::module_& m);
void bind_contour_cues(py::module_& m);
void bind_contour_grid(py::module_& m);
void bind_contour_memory(py::module_& m);
void bind_contour_options(py::module_& m);
void bind_device(py::module_& m);
void bind_dlpack(py::module_& m);
void bind_device_array(py::module_& m);
void bind_appearance(py::module_& m);
void bind_frame_energy(py::module_& m);
void bind_tracking(py::module_& m);
void bind_lens(py::module_& m);
void bind_levelset(py::module_& m);
void bind_lwpr(py::module_& m);
void bind_outline(py::module_& m);
void bind_photometric(py::module_& m);
void bind_motion(py::module_& m);
void bind_optimizer(py::module_& m);
void bind_option_schema(py::module_& m);
void bind_plane(py::module_& m);
void bind_primitives(py::module_& m);
void bind_beginning(py::module_& m);
void bind_reconstruction(py::module_& m);
void bind_session(py::module_& m);
void bind_search(py::module_& m);
void bind_start_parts(py::module_& m);
void bind_symmetry(py::module_& m);
void bind_render(py::module_& m);
void bind_sdf(py::module_& m);
void bind_single_fits(py::module_& m);
void bind_solids(py::module_& m);
void bind_superpixels(py::module_& m);
void bind_build(py::module_& m);

namespace {

// The message of a standard container's bad_alloc is only its name.
void tell_of_memory(std::exception_ptr thrown) {
  try {
    if (thrown) std::rethrow_exception(thrown);
  } catch (const std::bad_alloc& error) {
    const bool bare = std::string_view(error.what()) == std::bad_alloc().what();
    PyErr_SetString(PyExc_MemoryError,
                    bare ? "not enough free memory for the arrays of this call; smaller images, "
                           "fewer voxels or fewer samples need less"
                         : error.what());
  }
}

}  // namespace

}  // namespace sdftrack::bindings

PYBIND11_MODULE(_core, m) {
  m.doc() = "Private core of sdftrack; use the names of the package sdftrack.";
  m.attr("__version__") = SDFTRACK_VERSION;
  sdftrack::bindings::watch_for_the_end();
  pybind11::register_exception_translator(&sdftrack::bindings::tell_of_memory);
  sdftrack::bindings::bind_base(m);
  sdftrack::bindings::bind_device(m);
  sdftrack::bindings::bind_dlpack(m);
  sdftrack::bindings::bind_device_array(m);
  sdftrack::bindings::bind_appearance(m);
  sdftrack::bindings::bind_motion(m);
  sdftrack::bindings::bind_optimizer(m);
  sdftrack::bindings::bind_tracking(m);
  sdftrack::bindings::bind_levelset(m);
  sdftrack::bindings::bind_lwpr(m);
  sdftrack::bindings::bind_outline(m);
  sdftrack::bindings::bind_photometric(m);
  sdftrack::bindings::bind_plane(m);
  sdftrack::bindings::bind_solids(m);
  sdftrack::bindings::bind_primitives(m);
  sdftrack::bindings::bind_reconstruction(m);
  sdftrack::bindings::bind_beginning(m);
  sdftrack::bindings::bind_session(m);
  sdftrack::bindings::bind_search(m);
  sdftrack::bindings::bind_start_parts(m);
  sdftrack::bindings::bind_symmetry(m);
  sdftrack::bindings::bind_frame_energy(m);
  sdftrack::bindings::bind_single_fits(m);
  sdftrack::bindings::bind_render(m);
  sdftrack::bindings::bind_sdf(m);
  sdftrack::bindings::bind_lens(m);
  sdftrack::bindings::bind_calibration(m);
  sdftrack::bindings::bind_ball(m);
  sdftrack::bindings::bind_depth_errors(m);
  sdftrack::bindings::bind_depth_to_color(m);
  sdftrack::bindings::bind_contour_options(m);
  sdftrack::bindings::bind_contour(m);
  sdftrack::bindings::bind_contour_cues(m);
  sdftrack::bindings::bind_contour_grid(m);
  sdftrack::bindings::bind_contour_memory(m);
  sdftrack::bindings::bind_superpixels(m);
  sdftrack::bindings::bind_option_schema(m);
  sdftrack::bindings::bind_build(m);
}
