// SPDX-License-Identifier: MIT
#include "array.h"
#include "base/cuda_probe.h"

namespace sdftrack::bindings {

namespace {

std::vector<float> copy(const py::array& a, const char* name) {
  const float* data = borrow<float>(a, name, {-1});
  return {data, data + a.shape(0)};
}

py::array_t<float> scale_and_add(float a, const py::array& x, const py::array& y, int device) {
  const std::vector<float> x_values = copy(x, "x"), y_values = copy(y, "y");
  std::vector<float> out = device >= 0 ? scale_and_add_cuda(a, x_values, y_values, device)
                                       : scale_and_add_cpu(a, x_values, y_values);
  const auto n = static_cast<py::ssize_t>(out.size());
  return to_numpy(std::move(out), {n});
}

}  // namespace

void bind_device(py::module_& m) {
  m.attr("cuda_build") = cuda_built();
  m.def("cuda_devices", &cuda_devices, "Numbers of the CUDA devices that can be used.");
  m.def("cuda_least_capability", &cuda_least_capability,
        "The compute capability that the kernels need, as 10 major + minor.");
  m.def("cuda_device_name", &cuda_device_name, "device"_a = 0, "Its name; empty where it does not answer.");
  m.def("cuda_fingerprint", &cuda_fingerprint, "device"_a = 0,
        "Name, capability, driver and runtime of a device; empty where it does not answer.");
  m.def(
      "copy_from_cuda",
      [](std::uintptr_t address, py::array out) {
        const auto bytes = static_cast<std::size_t>(out.nbytes());
        void* const to = out.mutable_data();
        const py::gil_scoped_release release;
        copy_from_device(reinterpret_cast<const void*>(address), bytes, to);
      },
      "address"_a, "out"_a, "Fills an array from an address on a CUDA device.");
  m.def("scale_and_add", &scale_and_add, "a"_a, "x"_a, "y"_a, py::kw_only(), "device"_a = -1,
        "a x + y of (N,) float32 arrays: the smallest kernel, to test the device.");
}

}  // namespace sdftrack::bindings
