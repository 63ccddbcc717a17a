// SPDX-License-Identifier: MIT
// The structures of DLPack's stable C interface (https://dmlc.github.io/dlpack), with names only for the
// parts used here.
#pragma once

#include <cstdint>
#include <string>

#include "array.h"

namespace sdftrack::bindings::dlpack {

constexpr const char* kName = "dltensor";  // of a capsule that is not consumed yet

enum DeviceType : std::int32_t { kCpu = 1, kCuda = 2, kCudaHost = 3, kCudaManaged = 13 };
enum TypeCode : std::uint8_t { kInt = 0, kUInt = 1, kFloat = 2, kBool = 6 };

struct Tensor {
  void* data;
  struct {
    std::int32_t type, id;
  } device;
  std::int32_t ndim;
  struct {
    std::uint8_t code, bits;
    std::uint16_t lanes;
  } dtype;
  std::int64_t* shape;
  std::int64_t* strides;  // in elements; nullptr: C-contiguous
  std::uint64_t byte_offset;
};
struct ManagedTensor {
  Tensor tensor;
  void* context;
  void (*deleter)(ManagedTensor*);
};

py::dtype dtype_of(const Tensor& t, const std::string& name);  // TypeError if numpy lacks the type
bool is_contiguous(const Tensor& t);                           // C order

// A tensor lent by another library, from its capsule, which may be consumed once. The owner is notified when
// the tensor is no longer used.
class Borrowed {
 public:
  Borrowed(const py::object& capsule, const std::string& name);  // TypeError if it is used or not a capsule
  ~Borrowed();
  Borrowed(const Borrowed&) = delete;
  Borrowed& operator=(const Borrowed&) = delete;

  const Tensor& tensor() const { return managed_->tensor; }

 private:
  ManagedTensor* managed_;
};

}  // namespace sdftrack::bindings::dlpack
