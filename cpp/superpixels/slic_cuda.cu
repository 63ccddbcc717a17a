// SPDX-License-Identifier: MIT
// Superpixels on the GPU: memory and launches for slic_cuda.cuh. Compiled without fused multiply-add, so that
// colours are the CPU's to the bit.
#include <algorithm>
#include <vector>

#include "base/device_stream.h"
#include "superpixels/slic.h"
#include "superpixels/slic_cuda.cuh"

namespace sdftrack::superpixels {

namespace {

template <class Kernel>
__global__ void start(Kernel kernel) {
  kernel();
}

struct OnDevice {
  cudaStream_t stream;
  template <class Kernel>
  void operator()(int blocks, const Kernel& kernel) const {
    start<<<static_cast<unsigned>(std::max(1, blocks)), kBlockThreads, 0, stream>>>(kernel);
    SDFTRACK_CHECK_CUDA(cudaGetLastError());
  }
  void clear(int* value) const { SDFTRACK_CHECK_CUDA(cudaMemsetAsync(value, 0, sizeof(int), stream)); }
  int read(const int* value) const {
    int host = 0;
    SDFTRACK_CHECK_CUDA(cudaMemcpyAsync(&host, value, sizeof(int), cudaMemcpyDeviceToHost, stream));
    SDFTRACK_CHECK_CUDA(cudaStreamSynchronize(stream));
    return host;
  }
};

// Buffers that are kept from call to call, as large as the largest has asked for.
struct Memory {
  DeviceStream stream;
  DeviceBuffer<std::uint8_t> bytes, mask;
  DeviceBuffer<float> floats, light;
  DeviceBuffer<int> x_begin, y_begin, x_middle, y_middle, x_place, y_place, z;
  DeviceBuffer<int> c01, c2x, center, parent, size, labels, block_count, number, joined;
  DeviceBuffer<Word> best, sums;
  DeviceBuffer<Center> centers;
  DeviceBuffer<std::int64_t> moved;

  template <class T>
  T* room(DeviceBuffer<T>* buffer, std::size_t n) {
    if (buffer->size() < n) *buffer = DeviceBuffer<T>(n);
    return buffer->data();
  }
  template <class T>
  T* zeros(DeviceBuffer<T>* buffer, std::size_t n) {
    T* const data = room(buffer, n);
    SDFTRACK_CHECK_CUDA(cudaMemsetAsync(data, 0, n * sizeof(T), stream.get()));
    return data;
  }
  template <class T>
  const T* copy(DeviceBuffer<T>* buffer, const T* host, std::size_t n) {
    T* const data = room(buffer, n);
    stream.upload(host, n, data);
    return data;
  }
  template <class T>
  const T* copy(DeviceBuffer<T>* buffer, const std::vector<T>& host) {
    return copy(buffer, host.data(), host.size());
  }
};

std::vector<int> places(int length, const std::vector<int>& begin, const std::vector<int>& middle,
                        double unit) {
  std::vector<int> out(static_cast<std::size_t>(length));
  for (std::size_t i = 0; i < middle.size(); ++i)
    for (int x = begin[i]; x < begin[i + 1]; ++x)
      out[static_cast<std::size_t>(x)] = place_of(x, unit) - middle[i];
  return out;
}

std::vector<float> light_of_bytes(ColorSpace space) {
  std::vector<float> light(256);
  for (int i = 0; i < 256; ++i) light[static_cast<std::size_t>(i)] = static_cast<float>(i) / 255.f;
  if (space != ColorSpace::kRgb) RowOps::baseline.linearize(light.data(), 256, light.data());
  return light;
}

int longest(const std::vector<int>& begin) {
  int most = 0;
  for (std::size_t i = 0; i + 1 < begin.size(); ++i) most = std::max(most, begin[i + 1] - begin[i]);
  return most;
}

}  // namespace

SlicResult slic_cuda(const SlicImage& image, const SlicOptions& options, int* labels) {
  check_slic(image, options);
  thread_local Memory m;
  const auto pixels = static_cast<std::size_t>(image.height) * static_cast<std::size_t>(image.width);
  const auto channels = static_cast<std::size_t>(image.channels);
  const auto inside =
      image.mask ? std::count_if(image.mask, image.mask + pixels, [](std::uint8_t v) { return v != 0; })
                 : static_cast<std::ptrdiff_t>(pixels);
  if (inside == 0) throw std::invalid_argument("mask: expected at least one pixel inside, got none");
  const CellGrid g = make_grid(image.width, image.height, inside, options.n_segments, options.compactness);
  const auto cells = static_cast<std::size_t>(g.cells());
  std::vector<int> z(options.depth_weight > 0 ? pixels : 0);
  for (int y = 0; y < image.height && !z.empty(); ++y) {
    const std::size_t row = static_cast<std::size_t>(y) * static_cast<std::size_t>(image.width);
    depth_row(image.depth_m + row, image.width, options.depth_weight * g.scale, z.data() + row);
  }
  const std::vector<float> light = light_of_bytes(options.space);
  const std::vector<int> x_place = places(g.width, g.x_begin, g.x_middle, g.unit);
  const std::vector<int> y_place = places(g.height, g.y_begin, g.y_middle, g.unit);
  const SlicPlanes planes{image.bytes ? m.copy(&m.bytes, image.bytes, channels * pixels) : nullptr,
                          image.floats ? m.copy(&m.floats, image.floats, channels * pixels) : nullptr,
                          image.mask ? m.copy(&m.mask, image.mask, pixels) : nullptr,
                          m.copy(&m.light, light),
                          m.copy(&m.x_begin, g.x_begin),
                          m.copy(&m.y_begin, g.y_begin),
                          m.copy(&m.x_middle, g.x_middle),
                          m.copy(&m.y_middle, g.y_middle),
                          m.copy(&m.x_place, x_place),
                          m.copy(&m.y_place, y_place),
                          z.empty() ? nullptr : m.copy(&m.z, z),
                          m.room(&m.c01, pixels),
                          m.room(&m.c2x, pixels),
                          m.room(&m.center, pixels),
                          m.room(&m.parent, pixels),
                          m.room(&m.size, pixels),
                          m.room(&m.labels, pixels),
                          m.room(&m.best, pixels),
                          m.room(&m.centers, cells),
                          m.room(&m.sums, 7 * cells),
                          m.room(&m.block_count, pixels / kBlockThreads + 1),
                          m.zeros(&m.number, cells),
                          m.zeros(&m.moved, static_cast<std::size_t>(options.max_iterations)),
                          m.zeros(&m.joined, 1)};
  const double mean = static_cast<double>(inside) / options.n_segments;
  const SlicShape shape{image.width,
                        image.height,
                        image.channels,
                        g.nx,
                        g.ny,
                        g.unit,
                        static_cast<float>(g.scale),
                        options.first_label,
                        static_cast<int>(options.min_size * mean),
                        options.space,
                        options.distance};
  const OnDevice run{m.stream.get()};
  const std::int64_t largest = static_cast<std::int64_t>(longest(g.x_begin)) * longest(g.y_begin);
  slic_on_device(run, planes, shape, options.max_iterations, largest, options.connected);
  std::vector<std::int64_t> moved(static_cast<std::size_t>(options.max_iterations));
  m.stream.download(planes.labels, pixels, labels);
  m.stream.download(planes.moved, moved.size(), moved.data());
  SlicResult result;
  result.segments = run.read(planes.joined);
  while (result.iterations < options.max_iterations) {
    const std::int64_t way = moved[static_cast<std::size_t>(result.iterations++)];
    result.residual = static_cast<double>(way) / (g.scale * g.cells());
    if (way == 0) break;
  }
  return result;
}

}  // namespace sdftrack::superpixels
