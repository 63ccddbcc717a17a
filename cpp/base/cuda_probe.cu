// SPDX-License-Identifier: MIT
#include <cstdint>

#include "base/cuda_probe.h"
#include "base/launch.cuh"

namespace sdftrack {

namespace {

constexpr int kLeastCapability = SDFTRACK_LEAST_CAPABILITY;  // that the kernels need; from CMakeLists.txt

struct ScaleAndAdd {
  static constexpr const char* kName = "scale_and_add";
  static constexpr int kThreads = 256;
  float a;
  const float *x, *y;
  float* out;
  std::size_t n;
  __device__ void operator()() const {
    const std::size_t i = std::size_t(blockIdx.x) * kThreads + threadIdx.x;
    if (i < n) out[i] = scaled_sum(a, x[i], y[i]);
  }
};

// Reading an attribute takes microseconds; reading all properties takes a millisecond.
int capability_of(int device) {
  int major = 0, minor = 0;
  if (cudaDeviceGetAttribute(&major, cudaDevAttrComputeCapabilityMajor, device) == cudaSuccess &&
      cudaDeviceGetAttribute(&minor, cudaDevAttrComputeCapabilityMinor, device) == cudaSuccess)
    return 10 * major + minor;
  static_cast<void>(cudaGetLastError());
  return 0;
}

bool properties_of(int device, cudaDeviceProp* out) {
  if (cudaGetDeviceProperties(out, device) == cudaSuccess) return true;
  static_cast<void>(cudaGetLastError());
  return false;
}

}  // namespace

bool cuda_built() { return true; }

int cuda_least_capability() { return kLeastCapability; }

std::vector<int> cuda_devices() {
  int count = 0;
  if (cudaGetDeviceCount(&count) != cudaSuccess) {
    static_cast<void>(cudaGetLastError());
    return {};
  }
  std::vector<int> out;
  for (int device = 0; device < count; ++device)
    if (capability_of(device) >= kLeastCapability) out.push_back(device);
  return out;
}

std::string cuda_device_name(int device) {
  cudaDeviceProp properties{};
  return properties_of(device, &properties) ? properties.name : std::string();
}

std::string cuda_fingerprint(int device) {
  cudaDeviceProp p{};
  int driver = 0, runtime = 0;
  if (!properties_of(device, &p) || cudaDriverGetVersion(&driver) != cudaSuccess ||
      cudaRuntimeGetVersion(&runtime) != cudaSuccess)
    return {};
  std::string uuid;
  for (const char byte : p.uuid.bytes) {
    constexpr char kDigits[] = "0123456789abcdef";
    const auto b = static_cast<unsigned char>(byte);
    uuid += {kDigits[b / 16], kDigits[b % 16]};
  }
  return std::string(p.name) + ", " + uuid + ", " + std::to_string(p.major) + "." + std::to_string(p.minor) +
         ", driver " + std::to_string(driver) + ", runtime " + std::to_string(runtime);
}

void copy_from_device(const void* device, std::size_t bytes, void* host) {
  cudaPointerAttributes where{};
  SDFTRACK_CHECK_CUDA(cudaPointerGetAttributes(&where, device));
  if (where.type == cudaMemoryTypeUnregistered)
    throw CudaError("CUDA: expected an address of a device, got one that CUDA does not know");
  const DeviceScope scope(where.device);
  SDFTRACK_CHECK_CUDA(cudaDeviceSynchronize());  // a stream may still be writing there
  SDFTRACK_CHECK_CUDA(cudaMemcpy(host, device, bytes, cudaMemcpyDeviceToHost));
}

std::vector<float> scale_and_add_cuda(float a, const std::vector<float>& x, const std::vector<float>& y,
                                      int device) {
  if (x.size() != y.size())
    throw std::invalid_argument("scale_and_add: expected x and y of one length, got " +
                                std::to_string(x.size()) + " and " + std::to_string(y.size()));
  if (x.empty()) return {};
  const DeviceScope scope(device);
  const DeviceStream stream;
  DeviceBuffer<float> x_gpu(x.size()), y_gpu(x.size()), out_gpu(x.size());
  const StreamWaiter inputs(stream);
  stream.upload(x.data(), x.size(), x_gpu.data());
  stream.upload(y.data(), y.size(), y_gpu.data());
  launch(stream, blocks_of(static_cast<std::int64_t>(x.size()), ScaleAndAdd::kThreads),
         ScaleAndAdd{a, x_gpu.data(), y_gpu.data(), out_gpu.data(), x.size()});
  std::vector<float> out(x.size());
  const StreamWaiter waiter(stream);
  stream.download(out_gpu.data(), out.size(), out.data());
  stream.wait();
  return out;
}

}  // namespace sdftrack
