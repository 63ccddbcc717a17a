// SPDX-License-Identifier: MIT
// Without CUDA there is no array on a GPU.
#include "base/device_array.h"
#include "base/no_cuda.h"

namespace sdftrack {

struct DeviceArray::Impl {};

DeviceArray::DeviceArray(int, std::size_t) { no_cuda(); }
DeviceArray::~DeviceArray() = default;
DeviceArray::DeviceArray(DeviceArray&&) noexcept = default;
DeviceArray& DeviceArray::operator=(DeviceArray&&) noexcept = default;
int DeviceArray::device() const { return 0; }
void* DeviceArray::data() const { return nullptr; }
std::size_t DeviceArray::bytes() const { return 0; }
void DeviceArray::written_on(void*) {}
void DeviceArray::ready_for(ForeignStream) const {}
void DeviceArray::download(void*) const {}
void DeviceArray::upload(const void*) {}

}  // namespace sdftrack
