// SPDX-License-Identifier: MIT
#include <pybind11/eigen.h>
#include <pybind11/stl.h>

#include "array.h"
#include "py_tracker.h"

namespace sdftrack::bindings {

void bind_tracker_options(py::module_& m);
void bind_tracking_parts(py::module_& m);

void bind_tracking(py::module_& m) {
  bind_tracker_options(m);
  bind_tracking_parts(m);
  py::class_<PyTracker>(m, "Tracker", "Tracks shapes; see sdftrack.Tracker.")
      .def(py::init<const std::vector<PyVolume>&, const Camera&, const tracking::TrackerOptions&, int, bool,
                    tracking::MotionModel, int, tracking::Collision>(),
           py::arg("shapes"), py::arg("camera"), py::arg("options"), py::arg("threads"), py::arg("recover"),
           py::arg("motion"), py::arg("device"), py::arg("collision"))
      .def("start", &PyTracker::start, py::arg("frame"), py::arg("places"), py::arg("names"))
      .def("located", &PyTracker::located, py::arg("frame"), py::arg("places"))
      .def("place_of_click", &PyTracker::place_of_click, py::arg("frame"), py::arg("k"), py::arg("px"))
      .def("check_mask_size", &PyTracker::check_mask_size, py::arg("frame"), py::arg("k"), py::arg("mask"),
           py::arg("name"))
      .def("track", &PyTracker::track, py::arg("frame"), py::arg("names"))
      .def("recover", &PyTracker::recover, py::arg("frame"), py::arg("objects"), py::arg("places"),
           py::arg("names"))
      .def("revisit", &PyTracker::revisit, py::arg("frame"))
      .def("add", &PyTracker::add, py::arg("shape"), py::arg("place"))
      .def("remove", &PyTracker::remove, py::arg("k"))
      .def("replace_shapes", &PyTracker::replace_shapes, py::arg("shapes"), py::arg("poses"))
      .def("set_symmetry", &PyTracker::set_symmetry, py::arg("k"), py::arg("discrete"), py::arg("axes"))
      .def("mark_unfound", &PyTracker::mark_unfound, py::arg("k"), py::arg("kind"))
      .def("free_scale", &PyTracker::free_scale, py::arg("k"))
      .def("enlarged_volume", &PyTracker::enlarged_volume, py::arg("k"), py::arg("voxel_m"))
      .def("scale", &PyTracker::scale, py::arg("k"))
      .def("is_sure", &PyTracker::is_sure, py::arg("k"))
      .def("alternative_poses", &PyTracker::alternative_poses, py::arg("k"))
      .def("evidence", &PyTracker::evidence, py::arg("k"))
      .def("judge", &PyTracker::judge, py::arg("frame"), py::arg("k"), py::arg("T"))
      .def("reshape", &PyTracker::reshape, py::arg("k"), py::arg("shape"), py::arg("seen"), py::arg("least"),
           py::arg("boxes"), py::arg("colors") = py::none())
      .def("paint", &PyTracker::paint, py::arg("k"), py::arg("colors"))
      .def("membership", &PyTracker::membership, py::arg("frame"))
      .def("color_delay", &PyTracker::color_delay)
      .def_property_readonly("index", &PyTracker::index)
      .def_property_readonly("best", &PyTracker::best)
      .def("resume", &PyTracker::resume, py::arg("index"), py::arg("time_s"), py::arg("followed"),
           py::arg("best"))
      .def("interrupt", &PyTracker::interrupt, py::arg("index"))
      .def("state", &PyTracker::state,
           "All that the next frames depend on, but for shapes, camera and settings.")
      .def("set_state", &PyTracker::set_state, py::arg("state"),
           "Goes on from such a state; False, and nothing changed, where it is one of another version.")
      .def("set_camera", &PyTracker::set_camera, py::arg("camera"))
      .def("set_pose", &PyTracker::set_pose, py::arg("k"), py::arg("T"), py::arg("covariance"));
}

}  // namespace sdftrack::bindings
