// SPDX-License-Identifier: MIT
#include "frame/image/depth_metres.h"

#include <algorithm>
#include <cmath>

namespace sdftrack::frame {

namespace {

constexpr double kMostUnitsPerMetre = 1 << 24;  // floats hold whole numbers up to this one
constexpr double kSameUnit = 1e-7;              // drivers state units as floats: 0.001f is 1 mm
// Such holes over measurements: 0.118 with every fifth row missing, at most 0.015 from sensors.
constexpr double kLeastHoles = 0.05;
constexpr int kLookedAt = 11;  // rows apart; a prime, so that they are not those of the lattice
constexpr int kWidest = 2;
constexpr float kSameSurface = 0.02f;  // of the distance, across a hole

// Pixels of a row or a column.
template <class T>
struct Line {
  T* first;
  std::ptrdiff_t step;
  int count;

  T& operator()(int i) const { return first[i * step]; }
};

template <class T>
Line<T> row(T* depth_m, int width, int y) {
  return {depth_m + y * width, 1, width};
}
template <class T>
Line<T> column(T* depth_m, int width, int height, int x) {
  return {depth_m + x, width, height};
}

// Whether the `width` pixels after pixel i are a hole in one surface.
template <class T>
bool is_hole(const Line<T>& line, int i, int width) {
  const float left = line(i), right = line(i + width + 1);
  if (!(left > 0 && right > 0)) return false;
  for (int k = 1; k <= width; ++k)
    if (line(i + k) > 0) return false;
  return std::abs(left - right) <= kSameSurface * std::min(left, right);
}

void fill(const Line<float>& line, int width) {
  for (int i = 0; i + width + 1 < line.count; ++i) {
    if (!is_hole(line, i, width)) continue;
    const float left = line(i), right = line(i + width + 1);
    for (int k = 1; k <= width; ++k) line(i + k) = left + float(k) / float(width + 1) * (right - left);
  }
}

}  // namespace

void metres_of(const std::uint16_t* units, std::size_t count, double unit_m, float* depth_m) {
  const double per_m = std::nearbyint(std::min(1 / unit_m, kMostUnitsPerMetre));
  const bool whole = per_m < kMostUnitsPerMetre && std::abs(unit_m * per_m - 1) < kSameUnit;
  const float divisor = whole ? float(per_m) : 1.0f;
  const float factor = whole ? 1.0f : float(unit_m);
  std::transform(units, units + count, depth_m,
                 [=](std::uint16_t value) { return float(value) / divisor * factor; });
}

bool has_lattice(const ImageView<float>& depth_m) {
  const float* const data = depth_m.data;
  double holes = 0, measured = 0;
  const auto evaluate = [&](const Line<const float>& line) {
    for (int i = 0; i < line.count; ++i) {
      if (!(line(i) > 0)) continue;
      measured += 1;
      for (int width = 1; width <= kWidest && i + width + 1 < line.count; ++width)
        if (is_hole(line, i, width)) holes += width;
    }
  };
  for (int y = kLookedAt / 2; y < depth_m.height; y += kLookedAt) evaluate(row(data, depth_m.width, y));
  for (int x = kLookedAt / 2; x < depth_m.width; x += kLookedAt)
    evaluate(column(data, depth_m.width, depth_m.height, x));
  return holes > kLeastHoles * measured;
}

void fill_lattice(int width, int height, float* depth_m) {
  for (int hole = 1; hole <= kWidest; ++hole)
    for (int y = 0; y < height; ++y) fill(row(depth_m, width, y), hole);
  for (int hole = 1; hole <= kWidest; ++hole)
    for (int x = 0; x < width; ++x) fill(column(depth_m, width, height, x), hole);
}

}  // namespace sdftrack::frame
