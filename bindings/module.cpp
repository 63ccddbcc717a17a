// SPDX-License-Identifier: MIT
// The private extension module: thin, checked, typed. The public face is python/sdftrack/*.py.
#include <pybind11/pybind11.h>

#include <new>
#include <string_view>

#include "array.h"
#include "release_gil.h"

namespace sdftrack::bindings {

// A type is bound before the signatures that name it.
// clang-format off
#define SDFTRACK_PARTS(X) \
  X(base) X(device) X(dlpack) X(device_array) X(options) X(appearance) X(motion) X(tracking) \
  X(tracking_parts) X(levelset) X(lwpr) X(plane) X(solids) X(primitives) \
  X(reconstruction) X(beginning) X(session) X(search) X(symmetry) X(frame_energy) \
  X(single_fits) X(render) X(sdf) X(calibration) X(ball) X(depth_errors) X(depth_to_color) X(contour) \
  X(contour_cues) X(contour_grid) X(contour_memory) X(superpixels) X(build)
// clang-format on

#define SDFTRACK_DECLARE(part) void bind_##part(py::module_& m);
SDFTRACK_PARTS(SDFTRACK_DECLARE)

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
#define SDFTRACK_BIND(part) sdftrack::bindings::bind_##part(m);
  SDFTRACK_PARTS(SDFTRACK_BIND)
}
