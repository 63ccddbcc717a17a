// SPDX-License-Identifier: MIT
#include "base/cuda_probe.h"
#include "base/device_buffer.h"

namespace sdftrack {

namespace {

constexpr int kThreadsPerBlock = 256;

__global__ void scale_and_add_kernel(float a, const float* x, const float* y, float* out, std::size_t n) {
  const std::size_t i = static_cast<std::size_t>(blockIdx.x) * blockDim.x + threadIdx.x;
  if (i < n) out[i] = scaled_sum(a, x[i], y[i]);
}

}  // namespace

bool cuda_built() { return true; }

bool cuda_available() {
  int count = 0;
  return cudaGetDeviceCount(&count) == cudaSuccess && count > 0;
}

std::string cuda_device_name() {
  int device = 0;
  cudaDeviceProp properties{};
  if (!cuda_available() || cudaGetDevice(&device) != cudaSuccess ||
      cudaGetDeviceProperties(&properties, device) != cudaSuccess)
    return {};
  return properties.name;
}

void copy_from_device(const void* device, std::size_t bytes, void* host) {
  SDFTRACK_CHECK_CUDA(cudaDeviceSynchronize());  // whoever writes there may still be at it, on any stream
  SDFTRACK_CHECK_CUDA(cudaMemcpy(host, device, bytes, cudaMemcpyDeviceToHost));
}

std::vector<float> scale_and_add_cuda(float a, const std::vector<float>& x, const std::vector<float>& y) {
  if (x.size() != y.size())
    throw std::invalid_argument("scale_and_add: expected x and y of one length, got " +
                                std::to_string(x.size()) + " and " + std::to_string(y.size()));
  if (x.empty()) return {};
  const DeviceBuffer<float> x_gpu(x), y_gpu(y);
  DeviceBuffer<float> out(x.size());
  const auto blocks = static_cast<unsigned>((x.size() + kThreadsPerBlock - 1) / kThreadsPerBlock);
  scale_and_add_kernel<<<blocks, kThreadsPerBlock>>>(a, x_gpu.data(), y_gpu.data(), out.data(), x.size());
  SDFTRACK_CHECK_CUDA(cudaGetLastError());
  return out.to_host();
}

}  // namespace sdftrack
