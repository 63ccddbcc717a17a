// SPDX-License-Identifier: MIT
// Superpixels on the GPU: memory and launches for slic_cuda.cuh. Compiled without fused multiply-add, so that
// colours are the CPU's to the bit.
#include <algorithm>
#include <vector>

#include "base/device_pool.h"
#include "superpixels/slic.h"
#include "superpixels/slic_cuda.cuh"

namespace sdftrack::superpixels {

namespace {

// Buffers that are kept from call to call, as large as the largest has asked for.
struct Memory {
  DeviceStream stream;
  DeviceBuffer<std::uint8_t> bytes, mask;
  DeviceBuffer<float> floats, light;
  DeviceBuffer<int> x_begin, y_begin, x_middle, y_middle, x_place, y_place, z;
  DeviceBuffer<int> c01, c2x, center, parent, size, labels, block_count, number, joined, segments;
  DeviceBuffer<Word> best, sums;
  DeviceBuffer<Center> centers;
  DeviceBuffer<std::int64_t> moved;

  template <class T>
  T* zeros(DeviceBuffer<T>* buffer, std::size_t n) {
    T* const data = buffer->room(n);
    stream.fill_zero(data, n);
    return data;
  }
  template <class T>
  const T* copy(DeviceBuffer<T>* buffer, const T* host, std::size_t n) {
    T* const data = buffer->room(n);
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

// Starts kernels over pixels or cells, and looks at what they count.
struct Steps {
  const DeviceStream& stream;
  SlicPlanes p;
  SlicShape s;

  template <class Kernel>
  void by_pixel(const Kernel& kernel) const {
    launch(stream, blocks_of(s.pixels(), kBlockThreads), kernel);
  }
  template <class Kernel>
  void by_cell(const Kernel& kernel) const {
    launch(stream, blocks_of(s.cells(), kBlockThreads), kernel);
  }

  // Moves the centres until nothing moves, or for `rounds`: the way of all centres in each round.
  std::vector<std::int64_t> assign(int rounds, int parts) const {
    std::vector<std::int64_t> ways;
    std::int64_t moved[kRoundsAtOnce];
    const StreamWaiter waiter(stream);
    while (static_cast<int>(ways.size()) < rounds) {
      const int some = std::min(kRoundsAtOnce, rounds - static_cast<int>(ways.size()));
      stream.fill_zero(p.moved, kRoundsAtOnce);
      for (int round = 0; round < some; ++round) {
        by_cell(ClearSums{p, s});
        launch(stream, static_cast<unsigned>(s.cells() * parts), AssignPixels{p, s, round, parts});
        by_cell(MoveCenters{p, s, round});
      }
      stream.download(p.moved, static_cast<std::size_t>(some), moved);
      stream.wait();
      for (int round = 0; round < some; ++round) {
        ways.push_back(moved[round]);
        if (moved[round] == 0) return ways;
      }
    }
    return ways;
  }

  // Regions of one centre, small ones joined with a neighbour until none is left.
  void connect() const {
    by_pixel(StartRegions{p, s});
    by_pixel(JoinPixels{p, s});
    int joined[kJoinsAtOnce];
    const StreamWaiter waiter(stream);
    do {
      stream.fill_zero(p.joined, kJoinsAtOnce);
      for (int round = 0; round < kJoinsAtOnce; ++round) {
        by_pixel(Flatten{p, s, round});
        by_pixel(CountSizes{p, s, round});
        by_pixel(ChooseNeighbors{p, s, round});
        by_pixel(JoinChoices{p, s, round});
      }
      stream.download(p.joined, kJoinsAtOnce, joined);
      stream.wait();
    } while (joined[kJoinsAtOnce - 1] != 0);
  }

  void number(bool connected) const {
    if (connected) {
      by_pixel(CountRoots{p, s});
      const auto blocks = static_cast<int>(blocks_of(s.pixels(), kBlockThreads));
      launch(stream, 1, AddUp{p.block_count, blocks, p.segments});
      by_pixel(NumberRoots{p, s});
    } else {
      by_pixel(MarkCenters{p, s});
      launch(stream, 1, AddUp{p.number, s.cells(), p.segments});
    }
    by_pixel(WriteLabels{p, s, connected});
  }
};

}  // namespace

SlicResult slic_cuda(const SlicImage& image, const SlicOptions& options, int device, int* labels) {
  check_slic(image, options);
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
  SlicResult result;  // and the labels: outlive what the stream still writes
  const auto memory = pool_of<Memory>().borrow(device);
  Memory& m = *memory;
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
                          m.c01.room(pixels),
                          m.c2x.room(pixels),
                          m.center.room(pixels),
                          m.parent.room(pixels),
                          m.size.room(pixels),
                          m.labels.room(pixels),
                          m.best.room(pixels),
                          m.centers.room(cells),
                          m.sums.room(7 * cells),
                          m.block_count.room(pixels / kBlockThreads + 1),
                          m.zeros(&m.number, cells),
                          m.moved.room(kRoundsAtOnce),
                          m.joined.room(kJoinsAtOnce),
                          m.segments.room(1)};
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
  const std::int64_t largest = static_cast<std::int64_t>(longest(g.x_begin)) * longest(g.y_begin);
  const Steps steps{m.stream, planes, shape};
  steps.by_pixel(ConvertPixels{planes, shape});
  steps.by_cell(PlaceCenters{planes, shape});
  const std::vector<std::int64_t> ways =
      steps.assign(options.max_iterations, static_cast<int>((largest + kPart - 1) / kPart));
  if (options.connected) steps.connect();
  steps.number(options.connected);
  m.stream.download(planes.labels, pixels, labels);
  m.stream.download(planes.segments, 1, &result.segments);
  m.stream.wait();
  result.iterations = static_cast<int>(ways.size());
  result.residual = static_cast<double>(ways.back()) / (g.scale * g.cells());
  return result;
}

}  // namespace sdftrack::superpixels
