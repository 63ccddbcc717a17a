// SPDX-License-Identifier: MIT
#include "energies/outline_offset.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "base/to_int.h"

namespace sdftrack::energies {

namespace {

constexpr double kAmplitude = 0.42, kSlope = 0.6;
constexpr int kFarthest = 2 * kMaxReach + kBeyondReach;  // distance of a sample from an offset
// Keeps products of up to kMaxSamples factors, between 1/2 - a and 1/2 + a, from underflow.
constexpr float kGain = 1.6f;

// a tanh((r - d) / (2 s)) at [kFarthest - (r - d)]: for a sample r, entries of successive d are neighbours.
const std::array<float, 2 * kFarthest + 1>& steps() {
  static const std::array<float, 2 * kFarthest + 1> kSteps = [] {
    std::array<float, 2 * kFarthest + 1> out{};
    for (int x = -kFarthest; x <= kFarthest; ++x)
      out[kFarthest - x] = float(kAmplitude * std::tanh(x / (2 * kSlope)));
    return out;
  }();
  return kSteps;
}

double mean_of(const float* first, int count) {
  double sum = 0;
  for (int i = 0; i < count; ++i) sum += double(first[i]);
  return count > 0 ? sum / count : 0;
}

}  // namespace

OutlineOffset outline_offset(const float* chance, int reach) {
  constexpr int kMost = 2 * kMaxReach + 1;
  const int offsets = 2 * reach + 1, beyond = reach + kBeyondReach;
  float product[kMost];
  std::fill_n(product, offsets, 1.0f);
  for (int r = -beyond; r <= beyond; ++r) {
    const float towards = kGain * (1 - 2 * chance[r + beyond]);  // p_b - p_f
    const float* const step = steps().data() + (kFarthest - r - reach);
    for (int k = 0; k < offsets; ++k) product[k] *= 0.5f * kGain + towards * step[k];
  }
  double sum = 0, first = 0, second = 0;
  for (int k = 0; k < offsets; ++k) {
    const double p = double(product[k]), d = k - reach;
    sum += p, first += p * d, second += p * d * d;
  }
  if (!(sum > 0)) return {0, double(reach), 0};
  const double mean = first / sum, variance = std::max(0.0, second / sum - mean * mean);
  const int at = to_int(std::round(mean)) + beyond;
  const int inside = std::max(0, at - 1), outside = std::min(2 * beyond + 1, at + 2);
  return {mean, std::sqrt(variance),
          mean_of(chance, inside) - mean_of(chance + outside, 2 * beyond + 1 - outside)};
}

}  // namespace sdftrack::energies
