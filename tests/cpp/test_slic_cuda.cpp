// SPDX-License-Identifier: MIT
// The kernels of superpixels, their own source run on the CPU: the labels of the CPU's path.
#include <atomic>

#include "gpu_on_cpu.h"

template <class T>
T atomicAdd(T* to, T value) {
  return std::atomic_ref<T>(*to).fetch_add(value);
}
template <class T>
T atomicMax(T* to, T value) {
  std::atomic_ref<T> at(*to);
  T old = at.load();
  while (old < value && !at.compare_exchange_weak(old, value)) {
  }
  return old;
}
inline int atomicCAS(int* to, int expected, int value) {
  std::atomic_ref<int>(*to).compare_exchange_strong(expected, value);
  return expected;
}

#include <gtest/gtest.h>

#include "superpixels/slic.h"
#include "superpixels/slic_cuda.cuh"

namespace sdftrack {
namespace {

struct OnCpu {
  template <class Kernel>
  void operator()(int blocks, const Kernel& kernel) const {
    gpu_on_cpu::launch(blocks, [&] { kernel(); });
  }
  void clear(int* value) const { *value = 0; }
  int read(const int* value) const { return *value; }
};

std::vector<std::uint8_t> made_picture(int width, int height) {
  std::vector<std::uint8_t> bytes;
  unsigned state = 7;
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x)
      for (int k = 0; k < 3; ++k) {
        state = state * 1664525u + 1013904223u;
        bytes.push_back(static_cast<std::uint8_t>((x > 11 ? 120 : 30) + 3 * y + 10 * k + (state >> 27)));
      }
  return bytes;
}

std::vector<int> by_kernels(const superpixels::SlicImage& image, const superpixels::SlicOptions& o) {
  const auto pixels = static_cast<std::size_t>(image.width * image.height);
  const auto inside = image.mask ? std::count(image.mask, image.mask + pixels, 1) : static_cast<long>(pixels);
  const superpixels::CellGrid g =
      superpixels::make_grid(image.width, image.height, inside, o.n_segments, o.compactness);
  std::vector<float> light(256);
  for (int i = 0; i < 256; ++i) light[static_cast<std::size_t>(i)] = static_cast<float>(i) / 255.f;
  superpixels::RowOps::baseline.linearize(light.data(), 256, light.data());
  std::vector<int> x_place(static_cast<std::size_t>(g.width)), y_place(static_cast<std::size_t>(g.height));
  for (std::size_t i = 0; i < g.x_middle.size(); ++i)
    for (int x = g.x_begin[i]; x < g.x_begin[i + 1]; ++x)
      x_place[static_cast<std::size_t>(x)] = superpixels::place_of(x, g.unit) - g.x_middle[i];
  for (std::size_t j = 0; j < g.y_middle.size(); ++j)
    for (int y = g.y_begin[j]; y < g.y_begin[j + 1]; ++y)
      y_place[static_cast<std::size_t>(y)] = superpixels::place_of(y, g.unit) - g.y_middle[j];
  std::vector<int> c01(pixels), c2x(pixels), center(pixels), parent(pixels), size(pixels), labels(pixels);
  const auto cells = static_cast<std::size_t>(g.cells());
  std::vector<superpixels::Word> best(pixels), sums(7 * cells);
  std::vector<superpixels::Center> centers(cells);
  std::vector<int> block_count(pixels), number(cells);
  std::vector<std::int64_t> moved(static_cast<std::size_t>(o.max_iterations));
  int joined = 0;
  const superpixels::SlicPlanes p{image.bytes,        nullptr,          image.mask,        light.data(),
                                  g.x_begin.data(),   g.y_begin.data(), g.x_middle.data(), g.y_middle.data(),
                                  x_place.data(),     y_place.data(),   nullptr,           c01.data(),
                                  c2x.data(),         center.data(),    parent.data(),     size.data(),
                                  labels.data(),      best.data(),      centers.data(),    sums.data(),
                                  block_count.data(), number.data(),    moved.data(),      &joined};
  const double mean = static_cast<double>(inside) / o.n_segments;
  const superpixels::SlicShape s{image.width,
                                 image.height,
                                 3,
                                 g.nx,
                                 g.ny,
                                 g.unit,
                                 static_cast<float>(g.scale),
                                 o.first_label,
                                 static_cast<int>(o.min_size * mean),
                                 o.space,
                                 o.distance};
  superpixels::slic_on_device(OnCpu{}, p, s, o.max_iterations, std::int64_t{image.width} * image.height,
                              o.connected);
  return labels;
}

class SlicKernels : public testing::TestWithParam<int> {};

TEST_P(SlicKernels, give_the_labels_of_the_cpu) {
  constexpr int kWidth = 26, kHeight = 19;
  const std::vector<std::uint8_t> bytes = made_picture(kWidth, kHeight);
  std::vector<std::uint8_t> mask(bytes.size() / 3, 1);
  for (std::size_t i = 0; i < mask.size(); i += 7) mask[i] = i % 3 != 0;
  superpixels::SlicImage image;
  image.bytes = bytes.data(), image.width = kWidth, image.height = kHeight;
  superpixels::SlicOptions options;
  options.n_segments = 9, options.max_iterations = 3;
  if (GetParam() == 1) options.distance = superpixels::SlicDistance::kThesis;
  if (GetParam() == 2) options.connected = false;
  if (GetParam() == 3) image.mask = mask.data();
  std::vector<int> wanted(mask.size());
  superpixels::Slic().run(image, options, false, 1, wanted.data());
  EXPECT_EQ(by_kernels(image, options), wanted);
}

INSTANTIATE_TEST_SUITE_P(Ways, SlicKernels, testing::Range(0, 4));

}  // namespace
}  // namespace sdftrack
