// SPDX-License-Identifier: MIT
// The structures of DLPack's stable C interface (https://dmlc.github.io/dlpack), of which only what is used
// here is named.
#pragma once

#include <cstdint>
#include <string>

#include "array.h"

namespace sdftrack::bindings::dlpack {

constexpr const char* kName = "dltensor";  // of a capsule that nobody has taken over

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

py::dtype dtype_of(const Tensor& t, const std::string& name);  // TypeError: one that numpy has not
bool is_contiguous(const Tensor& t);                           // C order

// What another library lends, by its capsule, which may be consumed once: its owner is told when it is no
// longer used.
class Borrowed {
 public:
  Borrowed(const py::object& capsule, const std::string& name);  // TypeError: a used one, or none
  ~Borrowed();
  Borrowed(const Borrowed&) = delete;
  Borrowed& operator=(const Borrowed&) = delete;

  const Tensor& tensor() const { return managed_->tensor; }

 private:
  ManagedTensor* managed_;
};

}  // namespace sdftrack::bindings::dlpack
