// SPDX-License-Identifier: MIT
#include "appearance/color_model.h"

#include <array>
#include <cmath>
#include <numeric>

namespace sdftrack::appearance {

namespace {

constexpr float kUniformShare = 1e-3f;
constexpr float kMinPosterior = 0.02f;
constexpr int kMinPixels = 30;
constexpr double kMinFrontShare = 0.1;  // pixels in front over those of the object; fewer are stray pixels
constexpr float kMaxFrontShare = 0.3f;  // of the object's histogram, that may come from what holds it
constexpr float kFrontMargin = 1.5f;    // factor on the removed part: its colours vary from place to place

void pool(const std::vector<float>& counts, double total, double rate, std::vector<float>* share) {
  const auto keep = float(1 - rate), gain = float(rate / total);
  for (std::size_t i = 0; i < counts.size(); ++i) (*share)[i] = keep * (*share)[i] + gain * counts[i];
}

// [1 2 1] / 4 along the last axis; mirrored ends.
void smooth_rows(const std::vector<float>& in, std::vector<float>* out) {
  constexpr std::size_t n = kColorBinsPerChannel;
  for (std::size_t row = 0; row < in.size(); row += n) {
    float padded[n + 2];
    std::copy_n(in.data() + row, n, padded + 1);
    padded[0] = padded[1], padded[n + 1] = padded[n];
    float* const to = out->data() + row;
    for (std::size_t k = 0; k < n; ++k) to[k] = 0.25f * (padded[k] + 2.0f * padded[k + 1] + padded[k + 2]);
  }
}

// The same along an axis with a larger stride: rows of `stride` neighbours are one loop.
void smooth_axis(const std::vector<float>& in, std::size_t stride, std::vector<float>* out) {
  constexpr std::size_t n = kColorBinsPerChannel;
  for (std::size_t block = 0; block < in.size(); block += n * stride)
    for (std::size_t k = 0; k < n; ++k) {
      const float* const here = in.data() + block + k * stride;
      const float *const below = k > 0 ? here - stride : here, *const above =
                                                                   k + 1 < n ? here + stride : here;
      float* const to = out->data() + block + k * stride;
      for (std::size_t j = 0; j < stride; ++j) to[j] = 0.25f * (below[j] + 2.0f * here[j] + above[j]);
    }
}

// Summed in several lanes, which the compiler can vectorise.
double overlap_of(const std::vector<float>& f, const std::vector<float>& b) {
  constexpr std::size_t n = kColorBinsPerChannel;
  std::array<float, n> sums{};
  for (std::size_t row = 0; row < f.size(); row += n)
    for (std::size_t k = 0; k < n; ++k) sums[k] += std::sqrt(f[row + k] * b[row + k]);
  return std::accumulate(sums.begin(), sums.end(), 0.0);
}

// Weighted median of pairs of a value and its weight; the weights have the sum 1. Sorts the pairs.
float weighted_median(std::vector<std::pair<float, float>>* values) {
  std::sort(values->begin(), values->end());
  float below = 0;
  for (const auto& [value, weight] : *values)
    if ((below += weight) > 0.5f) return value;
  return values->back().first;
}

}  // namespace

void ColorCounts::clear() {
  std::fill(object.begin(), object.end(), 0.0f);
  std::fill(background.begin(), background.end(), 0.0f);
  std::fill(front.begin(), front.end(), 0.0f);
  object_pixels = background_pixels = front_pixels = 0, object_weight = 0;
}

void smooth_histogram(const std::vector<float>& share, std::vector<float>* scratch, std::vector<float>* out) {
  scratch->resize(share.size()), out->resize(share.size());
  for (std::size_t i = 0; i < share.size(); ++i)
    (*out)[i] = (1 - kUniformShare) * share[i] + kUniformShare / float(kColorBins);
  smooth_rows(*out, scratch);
  smooth_axis(*scratch, kColorBinsPerChannel, out);
  smooth_axis(*out, kColorBinsPerChannel * kColorBinsPerChannel, scratch);
  std::swap(*out, *scratch);
}

void ColorModel::update(const ColorCounts& counts, double object_rate, double background_rate) {
  if (!known_) {
    if (counts.object_pixels < kMinPixels) return;
    known_ = true, front_known_ = false;
    object_.assign(kColorBins, 0.0f);
    // Nothing was seen around the object: every colour is equally likely there.
    background_.assign(kColorBins, 1.0f / float(kColorBins));
    object_rate = background_rate = 1;
  }
  if (counts.object_pixels >= kMinPixels) pool(counts.object, counts.object_weight, object_rate, &object_);
  if (counts.background_pixels >= kMinPixels)
    pool(counts.background, counts.background_pixels, background_rate, &background_);
  if (counts.front_pixels >= std::max<double>(kMinPixels, kMinFrontShare * counts.object_pixels)) {
    front_.resize(kColorBins);
    pool(counts.front, counts.front_pixels, front_known_ ? background_rate : 1, &front_);
    front_known_ = true;
  }
  make_posterior();
}

bool ColorModel::are_shares(const std::vector<float>& values, bool known) {
  if (!known) return values.empty() || values.size() == kColorBins;
  const auto share = [](float v) { return v >= 0 && v <= 2; };
  return values.size() == kColorBins && std::all_of(values.begin(), values.end(), share) &&
         std::any_of(values.begin(), values.end(), [](float v) { return v > 0; });
}

// What holds the object also lies on it, and some of it is counted as the object's. If its colours have the
// same small share of the object's histogram throughout, they are removed; if the share is large, the object
// has these colours itself. docs/math/color.md, (4b).
void ColorModel::take_out_front() {
  if (!front_known_) return;
  smooth_histogram(front_, &scratch_, &smooth_front_);
  ratios_.clear();
  for (std::size_t i = 0; i < front_.size(); ++i)
    if (front_[i] > 0) ratios_.push_back({smooth_object_[i] / smooth_front_[i], front_[i]});
  const float share = weighted_median(&ratios_);
  if (share > kMaxFrontShare) return;
  const float least = kUniformShare / float(kColorBins);
  float sum = 0;
  for (std::size_t i = 0; i < front_.size(); ++i) {
    float& f = smooth_object_[i];
    f = std::max(f - kFrontMargin * share * smooth_front_[i], least);
    sum += f;
  }
  for (float& f : smooth_object_) f /= sum;
}

void ColorModel::make_posterior() {
  smooth_histogram(object_, &scratch_, &smooth_object_);
  smooth_histogram(background_, &scratch_, &smooth_background_);
  take_out_front();
  posterior_.resize(kColorBins);
  for (std::size_t i = 0; i < posterior_.size(); ++i) {
    const float f = smooth_object_[i], b = smooth_background_[i];
    posterior_[i] =
        std::clamp(prior_ * f / (prior_ * f + (1 - prior_) * b), kMinPosterior, 1 - kMinPosterior);
  }
  overlap_ = overlap_of(smooth_object_, smooth_background_);
}

}  // namespace sdftrack::appearance
