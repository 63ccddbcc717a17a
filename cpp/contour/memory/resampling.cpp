// SPDX-License-Identifier: MIT
#include "contour/memory/resampling.h"

#include <cmath>
#include <vector>

#include "base/to_int.h"

namespace sdftrack::contour {

namespace {

// A sample of a line as the weighted sum of samples of another line, starting at `first`.
struct Taps {
  int first = 0;
  std::vector<float> weights;
};

int within(int i, int n, Border border) {
  if (border == Border::kRepeated || n == 1) return std::clamp(i, 0, n - 1);
  while (i < 0 || i >= n) i = i < 0 ? -i : 2 * n - 2 - i;
  return i;
}

// Convolves rows and columns with the same odd kernel.
Picture convolved(const Picture& source, const std::vector<float>& kernel, Border border) {
  const int radius = int(kernel.size()) / 2;
  Picture along_x(source.width, source.height), out(source.width, source.height);
  std::vector<float> line(source.width + 2 * radius);
  for (int y = 0; y < source.height; ++y) {
    const float* from = source.row(y);
    for (int x = -radius; x < source.width + radius; ++x)
      line[x + radius] = from[within(x, source.width, border)];
    float* to = along_x.row(y);
    for (std::size_t k = 0; k < kernel.size(); ++k)
      for (int x = 0; x < source.width; ++x) to[x] += kernel[k] * line[std::size_t(x) + k];
  }
  for (int y = 0; y < source.height; ++y) {
    float* to = out.row(y);
    for (std::size_t k = 0; k < kernel.size(); ++k) {
      const float* from = along_x.row(within(y + int(k) - radius, source.height, border));
      for (int x = 0; x < source.width; ++x) to[x] += kernel[k] * from[x];
    }
  }
  return out;
}

Taps tap_of_area(int i, double step, int n) {
  const double begin = i * step, end = std::min(double(n), begin + step);
  Taps out{to_int(begin), {}};
  for (int k = out.first; k < n && k < end; ++k)
    out.weights.push_back(float((std::min(end, k + 1.0) - std::max(begin, 1.0 * k)) / step));
  return out;
}

Taps tap_between(int i, double step, int n) {
  const double x = std::clamp((i + 0.5) * step - 0.5, 0.0, n - 1.0);
  const int first = std::min(to_int(x), std::max(0, n - 2));
  const auto share = float(x - first);
  return n == 1 ? Taps{0, {1.0f}} : Taps{first, {1 - share, share}};
}

std::vector<Taps> taps_of(int from, int to, bool by_area) {
  std::vector<Taps> out;
  const double step = double(from) / to;
  for (int i = 0; i < to; ++i)
    out.push_back(by_area ? tap_of_area(i, step, from) : tap_between(i, step, from));
  return out;
}

}  // namespace

GridWarp after(const GridWarp& outer, const GridWarp& inner) {
  const double *a = outer.a, *b = inner.a;
  GridWarp out{{a[0] * b[0] + a[1] * b[2], a[0] * b[1] + a[1] * b[3], a[2] * b[0] + a[3] * b[2],
                a[2] * b[1] + a[3] * b[3]},
               {0, 0}};
  outer.to_image(inner.t[0], inner.t[1], &out.t[0], &out.t[1]);
  return out;
}

Picture resized(const Picture& source, int width, int height) {
  const bool by_area = width <= source.width && height <= source.height;
  Picture along_x(width, source.height), out(width, height);
  const std::vector<Taps> columns = taps_of(source.width, width, by_area);
  const std::vector<Taps> rows = taps_of(source.height, height, by_area);
  for (int y = 0; y < source.height; ++y)
    for (int x = 0; x < width; ++x) {
      const Taps& taps = columns[x];
      const float* from = source.row(y) + taps.first;
      for (const float weight : taps.weights) along_x.row(y)[x] += weight * *from++;
    }
  for (int y = 0; y < height; ++y) {
    int from = rows[y].first;
    for (const float weight : rows[y].weights) {
      const float* const line = along_x.row(from++);
      for (int x = 0; x < width; ++x) out.row(y)[x] += weight * line[x];
    }
  }
  return out;
}

// Summed in double, because small variances are differences of such means.
Picture box_mean(const Picture& source, int radius) {
  Plane<double> along_x(source.width, source.height);
  Picture out(source.width, source.height);
  std::vector<double> line(source.width + 2 * radius);
  for (int y = 0; y < source.height; ++y) {
    const float* const from = source.row(y);
    std::copy_n(from, source.width, line.begin() + radius);
    for (int k = 1; k <= radius; ++k) {
      line[radius - k] = double(from[within(-k, source.width, Border::kMirrored)]);
      line[source.width + radius - 1 + k] =
          double(from[within(source.width - 1 + k, source.width, Border::kMirrored)]);
    }
    double* const to = along_x.row(y);
    for (int k = 0; k <= 2 * radius; ++k)
      for (int x = 0; x < source.width; ++x) to[x] += line[x + k];
  }
  const double share = 1.0 / ((2 * radius + 1) * (2 * radius + 1));
  std::vector<double> sums;
  for (int y = 0; y < source.height; ++y) {
    sums.assign(source.width, 0);
    for (int k = y - radius; k <= y + radius; ++k) {
      const double* const from = along_x.row(within(k, source.height, Border::kMirrored));
      for (int x = 0; x < source.width; ++x) sums[x] += from[x];
    }
    for (int x = 0; x < source.width; ++x) out.row(y)[x] = float(share * sums[x]);
  }
  return out;
}

Picture blurred(const Picture& source, double sigma_px, Border border) {
  constexpr double kReach = 4;  // sigmas to each side
  const int radius = std::max(1, to_int(std::round(kReach * sigma_px)));
  std::vector<float> kernel;
  double sum = 0;
  for (int k = -radius; k <= radius; ++k) sum += std::exp(-0.5 * k * k / (sigma_px * sigma_px));
  for (int k = -radius; k <= radius; ++k)
    kernel.push_back(float(std::exp(-0.5 * k * k / (sigma_px * sigma_px)) / sum));
  return convolved(source, kernel, border);
}

}  // namespace sdftrack::contour
