// SPDX-License-Identifier: MIT
#include "array.h"
#include "base/cuda_probe.h"

namespace sdftrack::bindings {

namespace {

std::vector<float> copy(const py::array& a, const char* name) {
  const float* data = borrow<float>(a, name, {-1});
  return {data, data + a.shape(0)};
}

py::array_t<float> scale_and_add(float a, const py::array& x, const py::array& y, bool cuda) {
  const std::vector<float> x_values = copy(x, "x"), y_values = copy(y, "y");
  std::vector<float> out =
      cuda ? scale_and_add_cuda(a, x_values, y_values) : scale_and_add_cpu(a, x_values, y_values);
  const auto n = static_cast<py::ssize_t>(out.size());
  return to_numpy(std::move(out), {n});
}

}  // namespace

void bind_device(py::module_& m) {
  m.attr("cuda_build") = cuda_built();
  m.def("cuda_available", &cuda_available, "True when the build has CUDA and a device answers.");
  m.def("cuda_device_name", &cuda_device_name, "Name of the current CUDA device; empty without one.");
  m.def(
      "copy_from_cuda",
      [](std::uintptr_t address, py::array out) {
        copy_from_device(reinterpret_cast<const void*>(address), static_cast<std::size_t>(out.nbytes()),
                         out.mutable_data());
      },
      py::arg("address"), py::arg("out"), "Fills an array from an address on the current CUDA device.");
  m.def("scale_and_add", &scale_and_add, py::arg("a"), py::arg("x"), py::arg("y"), py::kw_only(),
        py::arg("cuda") = false, "a x + y of (N,) float32 arrays: the smallest kernel, to test the device.");
}

}  // namespace sdftrack::bindings
