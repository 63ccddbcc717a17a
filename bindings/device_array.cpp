// SPDX-License-Identifier: MIT
// Arrays on a GPU by DLPack and __cuda_array_interface__, without a copy.
#include "device_array.h"

#include "dlpack.h"

namespace sdftrack::bindings {

namespace {

constexpr int kCudaDevice = dlpack::kCuda;

// The tensor that another library takes over; the array lives as long as it does.
struct Lent {
  dlpack::ManagedTensor managed{};
  std::shared_ptr<OnDevice> array;
  std::vector<std::int64_t> shape;
};

py::object lend(const std::shared_ptr<OnDevice>& array, const py::object& stream) {
  // As in the array API: None is the legacy default stream, -1 no wait.
  const std::int64_t to = stream.is_none() ? 1 : py::cast<std::int64_t>(stream);
  if (to < -1 || to == 0)
    throw py::value_error("stream: expected -1, 1, 2 or the address of a CUDA stream, got " +
                          std::to_string(to));
  if (to > 0) array->memory.ready_for(static_cast<ForeignStream>(to));
  auto* const lent = new Lent{{}, array, {array->shape.begin(), array->shape.end()}};
  dlpack::Tensor& t = lent->managed.tensor;
  t.data = array->memory.data();
  t.device = {dlpack::kCuda, array->memory.device()};
  t.ndim = static_cast<std::int32_t>(lent->shape.size());
  t.shape = lent->shape.data();
  const char kind = array->dtype.kind();
  t.dtype = {static_cast<std::uint8_t>(kind == 'i'   ? dlpack::kInt
                                       : kind == 'u' ? dlpack::kUInt
                                                     : dlpack::kFloat),
             static_cast<std::uint8_t>(8 * array->dtype.itemsize()), 1};
  lent->managed.context = lent;
  lent->managed.deleter = [](dlpack::ManagedTensor* self) {
    const py::gil_scoped_acquire lock;  // may run on any thread of the other library
    delete static_cast<Lent*>(self->context);
  };
  return py::capsule(&lent->managed, dlpack::kName, [](PyObject* capsule) {
    // Not consumed: free it here.
    if (PyCapsule_IsValid(capsule, dlpack::kName)) {
      auto* const managed = static_cast<dlpack::ManagedTensor*>(PyCapsule_GetPointer(capsule, dlpack::kName));
      managed->deleter(managed);
    }
  });
}

py::dict interface_of(const OnDevice& array) {
  py::dict out;
  array.memory.ready_for(1);
  out["shape"] = py::tuple(py::cast(array.shape));
  out["typestr"] = array.dtype.attr("str");
  out["data"] = py::make_tuple(reinterpret_cast<std::uintptr_t>(array.memory.data()), false);
  out["strides"] = py::none();
  out["stream"] = 1;
  out["version"] = 3;
  return out;
}

py::array to_host(const OnDevice& array) {
  py::array out(array.dtype, array.shape);
  void* const to = out.mutable_data();
  const py::gil_scoped_release release;
  array.memory.download(to);
  return out;
}

}  // namespace

void bind_device_array(py::module_& m) {
  using dlpack::Borrowed;
  py::class_<Borrowed>(m, "BorrowedArray", "An array of another library, by its DLPack capsule.")
      .def(py::init([](const py::object& capsule) { return std::make_unique<Borrowed>(capsule, "array"); }),
           "capsule"_a)
      .def_property_readonly("address",
                             [](const Borrowed& b) {
                               return reinterpret_cast<std::uintptr_t>(b.tensor().data) +
                                      b.tensor().byte_offset;
                             })
      .def_property_readonly("shape",
                             [](const Borrowed& b) {
                               return py::tuple(py::cast(std::vector<std::int64_t>(
                                   b.tensor().shape, b.tensor().shape + b.tensor().ndim)));
                             })
      .def_property_readonly("dtype", [](const Borrowed& b) { return dlpack::dtype_of(b.tensor(), "array"); })
      .def_property_readonly("contiguous",
                             [](const Borrowed& b) { return dlpack::is_contiguous(b.tensor()); })
      .def_property_readonly("device", [](const Borrowed& b) { return b.tensor().device.id; });
  py::class_<OnDevice, std::shared_ptr<OnDevice>>(
      m, "DeviceArray",
      "An array on a CUDA device, C-contiguous. `torch.from_dlpack`, `cupy.from_dlpack` and "
      "`jax.dlpack.from_dlpack` take it without a copy; `numpy.asarray` copies it to the host.")
      .def_static(
          "of",
          [](const py::array& host, int device) {
            const py::array given = py::array::ensure(host, py::array::c_style);
            DeviceArray memory(device, static_cast<std::size_t>(given.nbytes()));
            memory.upload(given.data());
            return std::make_shared<OnDevice>(
                OnDevice{std::move(memory), given.dtype(), {given.shape(), given.shape() + given.ndim()}});
          },
          "array"_a, "device"_a, "A copy of an array of numpy.")
      .def_property_readonly("shape", [](const OnDevice& a) { return py::tuple(py::cast(a.shape)); })
      .def_readonly("dtype", &OnDevice::dtype)
      .def_property_readonly("device",
                             [](const OnDevice& a) { return "cuda:" + std::to_string(a.memory.device()); })
      .def("__len__", [](const OnDevice& a) { return a.shape.empty() ? 0 : a.shape[0]; })
      .def("__repr__",
           [](const OnDevice& a) {
             return "DeviceArray(" + std::string(py::str(a.dtype)) + ", " + shape_text(a.shape) +
                    ", cuda:" + std::to_string(a.memory.device()) + ")";
           })
      .def("__dlpack_device__",
           [](const OnDevice& a) { return py::make_tuple(kCudaDevice, a.memory.device()); })
      .def(
          "__dlpack__",
          [](const std::shared_ptr<OnDevice>& a, const py::object& stream, const py::object&,
             const py::object&, const py::object&) { return lend(a, stream); },
          py::kw_only(), "stream"_a = py::none(), "max_version"_a = py::none(), "dl_device"_a = py::none(),
          "copy"_a = py::none())
      .def_property_readonly("__cuda_array_interface__", &interface_of)
      .def("host", &to_host, "A copy on the host.")
      .def(
          "__array__",
          [](const OnDevice& a, const py::object& dtype, const py::object&) -> py::object {
            const py::array out = to_host(a);
            return dtype.is_none() ? py::object(out) : out.attr("astype")(dtype);
          },
          "dtype"_a = py::none(), "copy"_a = py::none());
}

}  // namespace sdftrack::bindings
