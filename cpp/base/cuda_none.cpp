// SPDX-License-Identifier: MIT
// In a build without CUDA, in place of the .cu files of this folder: no devices; the other functions throw.
#include "base/cuda_probe.h"
#include "base/device_array.h"
#include "base/no_cuda.h"

namespace sdftrack {

bool cuda_built() { return false; }
std::vector<int> cuda_devices() { return {}; }
int cuda_least_capability() { return 0; }
std::string cuda_device_name(int) { return {}; }
std::string cuda_fingerprint(int) { return {}; }

void copy_from_device(const void*, std::size_t, void*) { no_cuda(); }

std::vector<float> scale_and_add_cuda(float, const std::vector<float>&, const std::vector<float>&, int) {
  no_cuda();
}

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
