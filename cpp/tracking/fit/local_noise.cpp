// SPDX-License-Identifier: MIT
#include "tracking/fit/local_noise.h"

#include <algorithm>
#include <cmath>

namespace sdftrack::tracking {

namespace {

constexpr float kReach_px = 3;  // far enough for a sensor's smoothing, near enough for a flat surface
constexpr int kSamples = 400, kEnough = 20;

}  // namespace

double local_noise_m(const energies::PixelSet& pixels, std::vector<float>* scratch) {
  scratch->clear();
  const int n = pixels.count(), stride = std::max(1, n / kSamples);
  for (int i = 3; i + 3 < n; i += stride)
    for (int k = 1; k <= 3; ++k) {
      const auto a = std::size_t(i - k), b = std::size_t(i), c = std::size_t(i + k);
      const float left = pixels.u_px[b] - pixels.u_px[a], right = pixels.u_px[c] - pixels.u_px[b];
      if (right < kReach_px - 0.5f) continue;
      const bool straight = std::abs(left - right) < 0.5f && std::abs(pixels.v_px[a] - pixels.v_px[c]) < 0.5f;
      if (straight && right < 2 * kReach_px)
        scratch->push_back(std::abs(pixels.depth_m[a] - 2 * pixels.depth_m[b] + pixels.depth_m[c]) *
                           pixels.per_noise[b]);
      break;
    }
  if (scratch->size() < kEnough) return 0;
  const auto half = scratch->begin() + std::ptrdiff_t(scratch->size() / 2);
  std::nth_element(scratch->begin(), half, scratch->end());
  return double(*half) / (0.6745 * std::sqrt(6.0));
}

}  // namespace sdftrack::tracking
