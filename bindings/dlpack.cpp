// SPDX-License-Identifier: MIT
// Arrays of other libraries by DLPack (https://dmlc.github.io/dlpack): copied to the host from any device.
#include "dlpack.h"

#include <cstdint>
#include <cstring>

#include "array.h"
#include "base/cuda_probe.h"

namespace sdftrack::bindings {

namespace dlpack {

py::dtype dtype_of(const Tensor& t, const std::string& name) {
  const char kind = t.dtype.code == kInt     ? 'i'
                    : t.dtype.code == kUInt  ? 'u'
                    : t.dtype.code == kFloat ? 'f'
                    : t.dtype.code == kBool  ? 'b'
                                             : '?';
  const int bits = t.dtype.bits;
  const bool known = bits == 8 ? kind != 'f' : (bits == 16 || bits == 32 || bits == 64) && kind != 'b';
  if (kind == '?' || !known || t.dtype.lanes != 1)
    throw py::type_error(name + ": expected bool, integers or floats of up to 64 bits, got DLPack type " +
                         std::to_string(t.dtype.code) + " of " + std::to_string(bits) + " bits");
  return py::dtype(std::string("=") + kind + std::to_string(bits / 8));
}

bool is_contiguous(const Tensor& t) {
  if (!t.strides) return true;
  std::int64_t expected = 1;
  for (std::int32_t i = t.ndim - 1; i >= 0; --i) {
    if (t.shape[i] == 0) return true;
    if (t.shape[i] != 1 && t.strides[i] != expected) return false;
    expected *= t.shape[i];
  }
  return true;
}

Borrowed::Borrowed(const py::object& capsule, const std::string& name) {
  if (!PyCapsule_IsValid(capsule.ptr(), kName))
    throw py::type_error(name + ": expected an unused DLPack capsule");
  managed_ = static_cast<ManagedTensor*>(PyCapsule_GetPointer(capsule.ptr(), kName));
  PyCapsule_SetName(capsule.ptr(), "used_dltensor");
}
Borrowed::~Borrowed() {
  if (managed_->deleter) managed_->deleter(managed_);
}

}  // namespace dlpack

namespace {

using namespace dlpack;

py::array copy_to_host(const Tensor& t, const std::string& name) {
  const bool host = t.device.type == kCpu || t.device.type == kCudaHost;
  if (!host && t.device.type != kCuda && t.device.type != kCudaManaged)
    throw py::value_error(name + ": expected an array on the CPU or a CUDA device, got DLPack device type " +
                          std::to_string(t.device.type) + "; copy it to the host first");
  const py::dtype dtype = dtype_of(t, name);
  if (!is_contiguous(t))
    throw py::value_error(name + ": expected a C-contiguous array, got strides; make it contiguous first");
  py::array out(dtype, std::vector<py::ssize_t>(t.shape, t.shape + t.ndim));
  if (out.size() == 0) return out;
  const void* from = static_cast<const char*>(t.data) + t.byte_offset;
  const auto bytes = static_cast<std::size_t>(out.nbytes());
  if (host) {
    std::memcpy(out.mutable_data(), from, bytes);
  } else {
    void* const to = out.mutable_data();
    const py::gil_scoped_release release;
    copy_from_device(from, bytes, to);
  }
  return out;
}

py::array copy_from_dlpack(const py::object& capsule, const std::string& name) {
  return copy_to_host(Borrowed(capsule, name).tensor(), name);
}

}  // namespace

void bind_dlpack(py::module_& m) {
  m.def("copy_from_dlpack", &copy_from_dlpack, "capsule"_a, "name"_a,
        "A DLPack capsule as an array of its own on the host; `name` is for messages.");
}

}  // namespace sdftrack::bindings
