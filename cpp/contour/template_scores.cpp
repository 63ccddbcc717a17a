// SPDX-License-Identifier: MIT
#include "contour/template_scores.h"

#include <cstddef>

namespace sdftrack::contour {

namespace {

constexpr int kSums =
    16;  // side by side, so that any instruction set has something to do, with the same bits

float product(const float* a, const float* b, int length) {
  float sums[kSums] = {};
  int k = 0;
  for (; k + kSums <= length; k += kSums)
    for (int lane = 0; lane < kSums; ++lane) sums[lane] += a[k + lane] * b[k + lane];
  for (int lane = 0; k + lane < length; ++lane) sums[lane] += a[k + lane] * b[k + lane];
  for (int half = kSums / 2; half > 0; half /= 2)
    for (int lane = 0; lane < half; ++lane) sums[lane] += sums[lane + half];
  return sums[0];
}

}  // namespace

void template_scores(const float* pictures, int count, const float* templates, int template_count, int length,
                     float* out) {
  const auto row = static_cast<std::ptrdiff_t>(length);
  // A template stays in the nearest cache while all pictures pass by.
  for (int j = 0; j < template_count; ++j)
    for (int i = 0; i < count; ++i)
      out[static_cast<std::ptrdiff_t>(i) * template_count + j] =
          product(pictures + i * row, templates + j * row, length);
}

}  // namespace sdftrack::contour
