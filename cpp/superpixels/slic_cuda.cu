// SPDX-License-Identifier: MIT
// Superpixels on the GPU: the transfers and the launches: 25 kernels and one wait for an image of few rounds.
// Compiled without fused multiply-add, so that colours are bitwise equal to the CPU's.
#include <algorithm>
#include <utility>
#include <vector>

#include "base/device_pool.h"
#include "superpixels/slic.h"
#include "superpixels/slic_memory.h"
#include "superpixels/slic_regions.cuh"

namespace sdftrack::superpixels {

namespace {

std::vector<int> places(int length, const std::vector<int>& begin, const std::vector<int>& middle,
                        double unit) {
  std::vector<int> out(length);
  for (std::size_t i = 0; i < middle.size(); ++i)
    for (int x = begin[i]; x < begin[i + 1]; ++x) out[x] = place_of(x, unit) - middle[i];
  return out;
}

std::vector<float> light_of_bytes(ColorSpace space) {
  std::vector<float> light(256);
  for (int i = 0; i < 256; ++i) light[i] = float(i) / 255.f;
  if (space != ColorSpace::kRgb) RowOps::baseline.linearize(light.data(), 256, light.data());
  return light;
}

int longest(const std::vector<int>& begin) {
  int most = 0;
  for (std::size_t i = 0; i + 1 < begin.size(); ++i) most = std::max(most, begin[i + 1] - begin[i]);
  return most;
}

// Starts kernels over pixels or cells, and checks their counts.
struct Steps {
  SlicMemory& memory;
  SlicPlanes p;
  SlicShape s;
  int max_rounds, parts;  // of a cell
  bool connected;

  template <class Kernel>
  void by_pixel(const Kernel& kernel) const {
    launch(memory.stream, blocks_of(s.pixels(), kBlockThreads), kernel);
  }
  template <class Kernel>
  void by_cell(const Kernel& kernel) const {
    launch(memory.stream, blocks_of(s.cells(), kBlockThreads), kernel);
  }

  // Starts the rounds of k-means: all of them if they are few, else until nothing moves. Later rounds change
  // nothing. Returns how many were started.
  int assign() const {
    const auto blocks = static_cast<unsigned>(std::int64_t{s.cells()} * parts);
    for (int round = 0;; ++round) {
      if (round == max_rounds) return round;
      if (round > 0 && round % kRoundsAtOnce == 0 && ended(round)) return round;
      if (round > 0) move(round);
      launch(memory.stream, blocks, AssignPixels{p, s, round, parts});
    }
  }

  void move(int round) const {
    launch(memory.stream, blocks_of(s.cells(), MoveCenters::kThreads), MoveCenters{p, s, round});
  }

  // Makes regions of one centre and joins small ones with a neighbour until none is left, or keeps the
  // centres. The labels are sent before it is known whether the joins were enough, as they nearly always are.
  void label(int rounds, int* labels) const {
    if (rounds > 0) move(rounds);
    if (connected) {
      by_pixel(StartRegions{p, s});
      by_pixel(JoinPixels{p, s});
    } else {
      by_pixel(NumberCenters{p, s});
    }
    do {  // again if some were left
      for (int round = 0; round < kJoinsAtOnce && connected; ++round) {
        by_pixel(CountSizes{p, s, round});
        by_pixel(ChooseNeighbors{p, s, round});
        by_pixel(JoinChoices{p, s, round});
      }
      if (connected) by_pixel(NumberRoots{p, s});
      by_pixel(WriteLabels{p, s, connected});
      memory.fetch(std::size_t(s.pixels()), labels);
    } while (connected && joins_go_on());
  }

  // Number of rounds until nothing moved, and the motion in the last: of `rounds`, the ring holds the latest.
  std::pair<int, std::int64_t> last_way(int rounds) const {
    const SlicCounters& read = *memory.counters_host.data();
    for (int round = std::max(0, rounds - kRoundsAtOnce - 1); round < rounds; ++round)
      if (read.moved[ring_slot(round)] == 0) return {round + 1, 0};
    return {rounds, read.moved[ring_slot(rounds - 1)]};
  }

 private:
  bool joins_go_on() const {
    if (memory.counters_host.data()->joined[kJoinsAtOnce - 1] == 0) return false;
    memory.stream.fill_zero(p.counters->joined, kJoinsAtOnce);
    return true;
  }
  // Whether a round before the last of `rounds`, whose motion is not known yet, moved nothing.
  bool ended(int rounds) const {
    memory.stream.download(p.counters, 1, memory.counters_host.data());
    memory.stream.wait();
    return rounds > 1 && last_way(rounds - 1).second == 0;
  }
};

}  // namespace

SlicResult slic_cuda(const SlicImage& image, const SlicOptions& options, int device, int* labels,
                     DeviceArray* labels_there) {
  check_slic(image, options);
  const auto pixels = std::size_t(image.height) * image.width;
  const auto channels = std::size_t(image.channels);
  const auto inside =
      image.mask ? std::count_if(image.mask, image.mask + pixels, [](std::uint8_t v) { return v != 0; })
                 : std::ptrdiff_t(pixels);
  if (inside == 0) throw std::invalid_argument("mask: expected at least one pixel inside, got none");
  const CellGrid g = make_grid(image.width, image.height, inside, options.n_segments, options.compactness);
  const auto cells = std::size_t(g.cells());
  std::vector<int> z(options.depth_weight > 0 ? pixels : 0);
  for (int y = 0; y < image.height && !z.empty(); ++y) {
    const std::size_t row = std::size_t(y) * image.width;
    depth_row(image.depth_m + row, image.width, options.depth_weight * g.scale, z.data() + row);
  }
  const std::vector<float> light = light_of_bytes(options.space);
  const std::vector<int> x_place = places(g.width, g.x_begin, g.x_middle, g.unit);
  const std::vector<int> y_place = places(g.height, g.y_begin, g.y_middle, g.unit);
  SlicInputs given;
  const auto optional = [&](const auto* host, std::size_t n) { return host ? given.add(host, n) : 0; };
  const std::size_t at_bytes = optional(image.bytes, channels * pixels),
                    at_floats = optional(image.floats, channels * pixels),
                    at_mask = optional(image.mask, pixels), at_z = given.add(z), at_light = given.add(light),
                    at_x = given.add(g.x_begin), at_y = given.add(g.y_begin),
                    at_x_middle = given.add(g.x_middle), at_y_middle = given.add(g.y_middle),
                    at_x_place = given.add(x_place), at_y_place = given.add(y_place);
  const auto memory = pool_of<SlicMemory>().borrow(device);
  SlicMemory& m = *memory;
  if (image.there) m.stream.follow(image.there->stream);
  m.send(given, pixels);
  const auto ints = [&](std::size_t at) { return reinterpret_cast<const int*>(m.inputs.data() + at); };
  const auto floats = [&](std::size_t at) { return reinterpret_cast<const float*>(m.inputs.data() + at); };
  const auto bytes = [&](std::size_t at) {
    return reinterpret_cast<const std::uint8_t*>(m.inputs.data() + at);
  };
  int* const c01 = m.c01.room(pixels);
  const SlicPlanes planes{image.there   ? static_cast<const std::uint8_t*>(image.there->data)
                          : image.bytes ? bytes(at_bytes)
                                        : nullptr,
                          image.floats ? floats(at_floats) : nullptr,
                          image.mask ? bytes(at_mask) : nullptr,
                          floats(at_light),
                          ints(at_x),
                          ints(at_y),
                          ints(at_x_middle),
                          ints(at_y_middle),
                          ints(at_x_place),
                          ints(at_y_place),
                          z.empty() ? nullptr : ints(at_z),
                          c01,
                          m.c2x.room(pixels),
                          m.center.room(pixels),
                          m.parent.room(pixels),
                          m.size.room(pixels),
                          labels_there ? static_cast<int*>(labels_there->data()) : m.labels.room(pixels),
                          c01,
                          m.best.room(pixels),
                          m.centers.room(2 * cells),
                          m.sums.room(3 * kSums * cells),
                          m.block_count.room(pixels / kBlockThreads + 1),
                          m.number.room(cells),
                          m.counters.data()};
  const double mean = double(inside) / options.n_segments;
  const SlicShape shape{image.width,
                        image.height,
                        image.channels,
                        g.nx,
                        g.ny,
                        g.unit,
                        float(g.scale),
                        options.first_label,
                        int(options.min_size * mean),
                        options.space,
                        options.distance};
  const std::int64_t largest = static_cast<std::int64_t>(longest(g.x_begin)) * longest(g.y_begin);
  const Steps steps{
      m, planes, shape, options.max_iterations, int((largest + kPart - 1) / kPart), options.connected};
  steps.by_pixel(ConvertPixels{planes, shape});
  steps.by_cell(PlaceCenters{planes, shape});
  const int rounds = steps.assign();
  steps.label(rounds, labels);
  if (labels_there) labels_there->written_on(m.stream.get());
  const auto [iterations, way] = steps.last_way(rounds);
  SlicResult result;
  result.segments = m.counters_host.data()->segments;
  result.iterations = iterations;
  result.residual = double(way) / (g.scale * g.cells());
  return result;
}

}  // namespace sdftrack::superpixels
