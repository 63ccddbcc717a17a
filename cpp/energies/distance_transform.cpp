// SPDX-License-Identifier: MIT
#include "energies/distance_transform.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>

namespace sdftrack {

namespace {

// Squared distance along one line: the lower envelope of parabolas rooted at f[0], f[stride], ...
void transform_line(float* f, int n, int stride, float* value, int* root, float* border) {
  constexpr float kFar = std::numeric_limits<float>::max();
  int k = -1;
  for (int q = 0; q < n; ++q) {
    value[q] = f[static_cast<std::ptrdiff_t>(q) * stride];
    if (value[q] == kFar) continue;
    float s = -kFar;
    while (k >= 0) {
      const int r = root[k];
      s = (value[q] + static_cast<float>(q * q) - value[r] - static_cast<float>(r * r)) /
          (2.0f * static_cast<float>(q - r));
      if (s > border[k]) break;
      --k;
    }
    if (k < 0) s = -kFar;
    root[++k] = q, border[k] = s;
  }
  if (k < 0) return;  // nothing on this line
  const int last = k;
  k = 0;
  for (int q = 0; q < n; ++q) {
    while (k < last && border[k + 1] < static_cast<float>(q)) ++k;
    const int d = q - root[k];
    f[static_cast<std::ptrdiff_t>(q) * stride] = static_cast<float>(d * d) + value[root[k]];
  }
}

}  // namespace

void distance_transform(const std::vector<unsigned char>& free, DistanceScratch* scratch,
                        DistanceGrid* grid) {
  const int w = grid->width, h = grid->height;
  std::vector<float>& d = grid->distance_px;
  d.resize(free.size());
  for (std::size_t i = 0; i < free.size(); ++i) d[i] = free[i] ? std::numeric_limits<float>::max() : 0.0f;
  const auto n = static_cast<std::size_t>(std::max(w, h));
  scratch->value.resize(n), scratch->border.resize(n), scratch->root.resize(n);
  float* value = scratch->value.data();
  float* border = scratch->border.data();
  int* root = scratch->root.data();
  for (int x = 0; x < w; ++x) transform_line(d.data() + x, h, w, value, root, border);
  for (int y = 0; y < h; ++y)
    transform_line(d.data() + static_cast<std::ptrdiff_t>(y) * w, w, 1, value, root, border);
  for (float& v : d) v = std::min(grid->limit_px, static_cast<float>(grid->step) * std::sqrt(v));
}

}  // namespace sdftrack
