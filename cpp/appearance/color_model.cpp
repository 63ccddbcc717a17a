// SPDX-License-Identifier: MIT
#include "appearance/color_model.h"

#include <algorithm>
#include <cmath>

namespace sdftrack {

namespace {

constexpr float kUniformShare = 1e-3f;
constexpr float kLeastPosterior = 0.02f;
constexpr int kLeastPixels = 30;

void pool(const std::vector<float>& counts, double total, double rate, std::vector<float>* share) {
  const auto keep = static_cast<float>(1 - rate), gain = static_cast<float>(rate / total);
  for (std::size_t i = 0; i < counts.size(); ++i) (*share)[i] = keep * (*share)[i] + gain * counts[i];
}

// [1 2 1] / 4 along the axis with this stride; mirrored ends.
void smooth_axis(const std::vector<float>& in, std::size_t stride, std::vector<float>* out) {
  constexpr std::size_t kLast = kColorBinsPerChannel - 1;
  for (std::size_t i = 0; i < in.size(); ++i) {
    const std::size_t k = i / stride % kColorBinsPerChannel;
    const float below = in[k > 0 ? i - stride : i], above = in[k < kLast ? i + stride : i];
    (*out)[i] = 0.25f * (below + 2.0f * in[i] + above);
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
  smooth_axis(*out, 1, scratch);
  smooth_axis(*scratch, kColorBinsPerChannel, out);
  smooth_axis(*out, kColorBinsPerChannel * kColorBinsPerChannel, scratch);
  std::swap(*out, *scratch);
}

void ColorModel::update(const ColorCounts& counts, double object_rate, double background_rate) {
  if (!known_) {
    if (counts.object_pixels < kLeastPixels) return;
    known_ = true;
    object_.assign(kColorBins, 0.0f);
    // Nothing seen around the object: any colour is as likely there as any other.
    background_.assign(kColorBins, 1.0f / static_cast<float>(kColorBins));
    object_rate = background_rate = 1;
  }
  if (counts.object_pixels >= kLeastPixels) pool(counts.object, counts.object_weight, object_rate, &object_);
  if (counts.background_pixels >= kLeastPixels)
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
        std::clamp(prior_ * f / (prior_ * f + (1 - prior_) * b), kLeastPosterior, 1 - kLeastPosterior);
    overlap_ += static_cast<double>(std::sqrt(f * b));
  }
}

}  // namespace sdftrack
