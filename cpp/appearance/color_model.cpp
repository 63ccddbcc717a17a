// SPDX-License-Identifier: MIT
#include "appearance/color_model.h"

#include <algorithm>
#include <cmath>

namespace sdftrack::appearance {

namespace {

constexpr float kUniformShare = 1e-3f;
constexpr float kMinPosterior = 0.02f;
constexpr int kMinPixels = 30;

void pool(const std::vector<float>& counts, double total, double rate, std::vector<float>* share) {
  const auto keep = static_cast<float>(1 - rate), gain = static_cast<float>(rate / total);
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

}  // namespace

void ColorCounts::clear() {
  std::fill(object.begin(), object.end(), 0.0f);
  std::fill(background.begin(), background.end(), 0.0f);
  object_pixels = background_pixels = 0, object_weight = 0;
}

void smooth_histogram(const std::vector<float>& share, std::vector<float>* scratch, std::vector<float>* out) {
  scratch->resize(share.size()), out->resize(share.size());
  for (std::size_t i = 0; i < share.size(); ++i)
    (*out)[i] = (1 - kUniformShare) * share[i] + kUniformShare / static_cast<float>(kColorBins);
  smooth_rows(*out, scratch);
  smooth_axis(*scratch, kColorBinsPerChannel, out);
  smooth_axis(*out, kColorBinsPerChannel * kColorBinsPerChannel, scratch);
  std::swap(*out, *scratch);
}

void ColorModel::update(const ColorCounts& counts, double object_rate, double background_rate) {
  if (!known_) {
    if (counts.object_pixels < kMinPixels) return;
    known_ = true;
    object_.assign(kColorBins, 0.0f);
    // Nothing seen around the object: any colour is as likely there as any other.
    background_.assign(kColorBins, 1.0f / static_cast<float>(kColorBins));
    object_rate = background_rate = 1;
  }
  if (counts.object_pixels >= kMinPixels) pool(counts.object, counts.object_weight, object_rate, &object_);
  if (counts.background_pixels >= kMinPixels)
    pool(counts.background, counts.background_pixels, background_rate, &background_);
  make_posterior();
}

void ColorModel::make_posterior() {
  smooth_histogram(object_, &scratch_, &smooth_object_);
  smooth_histogram(background_, &scratch_, &smooth_background_);
  posterior_.resize(kColorBins);
  overlap_ = 0;
  for (std::size_t i = 0; i < posterior_.size(); ++i) {
    const float f = smooth_object_[i], b = smooth_background_[i];
    posterior_[i] =
        std::clamp(prior_ * f / (prior_ * f + (1 - prior_) * b), kMinPosterior, 1 - kMinPosterior);
    overlap_ += static_cast<double>(std::sqrt(f * b));
  }
}

}  // namespace sdftrack::appearance
