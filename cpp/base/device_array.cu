// SPDX-License-Identifier: MIT
#include "base/device_array.h"
#include "base/device_stream.h"

namespace sdftrack {

struct DeviceArray::Impl {
  Impl(int device_, std::size_t bytes) : device(device_), memory(bytes) {
    SDFTRACK_CHECK_CUDA(cudaEventCreateWithFlags(&written, cudaEventDisableTiming));
  }
  ~Impl() {
    if (cudaEventDestroy(written) != cudaSuccess) static_cast<void>(cudaGetLastError());
  }

  int device;
  DeviceBuffer<unsigned char> memory;
  cudaEvent_t written = nullptr;
};

DeviceArray::DeviceArray(int device, std::size_t bytes) {
  const DeviceScope scope(device);
  impl_ = std::make_unique<Impl>(device, bytes);
}
DeviceArray::~DeviceArray() = default;
DeviceArray::DeviceArray(DeviceArray&&) noexcept = default;
DeviceArray& DeviceArray::operator=(DeviceArray&&) noexcept = default;

int DeviceArray::device() const { return impl_->device; }
void* DeviceArray::data() const { return impl_->memory.data(); }
std::size_t DeviceArray::bytes() const { return impl_->memory.size(); }

void DeviceArray::written_on(void* stream) {
  SDFTRACK_CHECK_CUDA(cudaEventRecord(impl_->written, static_cast<cudaStream_t>(stream)));
}

void DeviceArray::ready_for(ForeignStream stream) const {
  const DeviceScope scope(impl_->device);
  SDFTRACK_CHECK_CUDA(cudaStreamWaitEvent(reinterpret_cast<cudaStream_t>(stream), impl_->written, 0));
}

void DeviceArray::download(void* host) const {
  const DeviceScope scope(impl_->device);
  const DeviceStream stream;
  const StreamWaiter waiter(stream);
  SDFTRACK_CHECK_CUDA(cudaStreamWaitEvent(stream.get(), impl_->written, 0));
  stream.download(impl_->memory.data(), impl_->memory.size(), static_cast<unsigned char*>(host));
  stream.wait();
}

void DeviceArray::upload(const void* host) {
  const DeviceScope scope(impl_->device);
  const DeviceStream stream;
  const StreamWaiter waiter(stream);
  stream.upload(static_cast<const unsigned char*>(host), impl_->memory.size(), impl_->memory.data());
  written_on(stream.get());
  stream.wait();
}

}  // namespace sdftrack
