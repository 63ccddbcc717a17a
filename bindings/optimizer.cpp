// SPDX-License-Identifier: MIT
#include <pybind11/stl.h>

#include "array.h"
#include "optim/lm.h"

namespace sdftrack::bindings {

void bind_optimizer(py::module_& m) {
  py::class_<optim::State>(m, "State", "A point in the space of unknowns, in the core's own frames.");
  py::class_<optim::LmOptions>(m, "LmOptions", "Options of the optimiser.")
      .def(py::init<>())
      .def_readwrite("max_steps", &optim::LmOptions::max_steps)
      .def_readwrite("damping", &optim::LmOptions::damping)
      .def_readwrite("damping_up", &optim::LmOptions::damping_up)
      .def_readwrite("damping_down", &optim::LmOptions::damping_down)
      .def_readwrite("damping_min", &optim::LmOptions::damping_min)
      .def_readwrite("damping_max", &optim::LmOptions::damping_max)
      .def_readwrite("step_m", &optim::LmOptions::step_m)
      .def_readwrite("step_rad", &optim::LmOptions::step_rad)
      .def_readwrite("step_relative", &optim::LmOptions::step_relative)
      .def_readwrite("cost_relative", &optim::LmOptions::cost_relative)
      .def_readwrite("cost_gain", &optim::LmOptions::cost_gain)
      .def_readwrite("sure_gain", &optim::LmOptions::sure_gain)
      .def_readwrite("fixed", &optim::LmOptions::fixed);
}

}  // namespace sdftrack::bindings
