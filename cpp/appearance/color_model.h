// SPDX-License-Identifier: MIT
// The colours of an object and of its surroundings: two histograms, and the posterior of each colour.
#pragma once

#include <algorithm>
#include <utility>
#include <vector>

#include "base/hd.h"

namespace sdftrack::appearance {

constexpr int kColorBinsPerChannel = 16;
constexpr int kColorBins = kColorBinsPerChannel * kColorBinsPerChannel * kColorBinsPerChannel;

HD int color_bin(const unsigned char* rgb) {
  return ((rgb[0] >> 4) << 8) | ((rgb[1] >> 4) << 4) | (rgb[2] >> 4);
}

// Pixels per colour, of one frame. A pixel of the object may have a weight below one.
struct ColorCounts {
  std::vector<float> object = std::vector<float>(kColorBins), background = std::vector<float>(kColorBins),
                     front = std::vector<float>(kColorBins);
  int object_pixels = 0, background_pixels = 0, front_pixels = 0;
  double object_weight = 0;

  void clear();
  void add_object(int bin, float weight = 1) {
    object[bin] += weight, object_weight += double(weight);
    ++object_pixels;
  }
  void add_background(int bin) { background[bin] += 1, ++background_pixels; }
  // Colours of what stands in front of the object; it may count as background too.
  void add_front(int bin) { front[bin] += 1, ++front_pixels; }
};

// p(colour | object), without what holds the object, and p(colour | background), each smoothed, and
//   P_f = prior p_f / (prior p_f + (1 - prior) p_b),
// kept between two bounds, because no colour is conclusive. A colour seen on neither side gives the prior.
class ColorModel {
 public:
  explicit ColorModel(float prior = 0.7f) : prior_(prior) {}

  // True once it was made from enough pixels of the object; without that it gives no information.
  bool known() const { return known_; }
  void forget() { known_ = false; }
  float prior() const { return prior_; }
  // Weight of a surface pixel of this colour in the histogram: small where it probably shows something else.
  float weight(int bin) const { return known_ ? std::min(1.0f, posterior_[bin] / prior_) : 1.0f; }
  // Posterior of every colour bin.
  const std::vector<float>& posterior() const { return posterior_; }
  // Density of a colour on the object and around it, relative to a uniform distribution; valid once known.
  float object_density(int bin) const { return kColorBins * smooth_object_[bin]; }
  float background_density(int bin) const { return kColorBins * smooth_background_[bin]; }
  // Sum of sqrt(p_f p_b): 1, the colours give no information; 0, they separate object and background.
  double overlap() const { return overlap_; }

  // The first call sets the histograms; later ones mix counts in by the linear opinion pool
  // p <- (1 - rate) p + rate p_new (thesis Eq. 4.22). A histogram is unchanged if it gets too few pixels.
  void update(const ColorCounts& counts, double object_rate, double background_rate);

  template <class Archive, class Self>
  static void visit(Archive& archive, Self& self) {
    auto& [prior, known, front_known, object, background, front, posterior, smooth_object, smooth_background,
           smooth_front, scratch, ratios, overlap] = self;
    archive(prior, known, front_known, object, background, front, posterior, smooth_object, smooth_background,
            smooth_front, overlap);
    for (const auto* shares : {&object, &background, &posterior, &smooth_object, &smooth_background})
      archive.check(are_shares(*shares, known));
    archive.check(are_shares(front, front_known) && are_shares(smooth_front, front_known));
  }

 private:
  // Whether there is a valid share for every colour, and not all are 0.
  static bool are_shares(const std::vector<float>& values, bool known);
  void make_posterior();
  void take_out_front();

  float prior_;
  bool known_ = false, front_known_ = false;
  std::vector<float> object_, background_, front_;  // as counted, sum 1
  std::vector<float> posterior_, smooth_object_, smooth_background_, smooth_front_, scratch_;
  std::vector<std::pair<float, float>> ratios_;  // object over front, and the weight, of colours in front
  double overlap_ = 0;
};

// 1e-3 of a uniform distribution, then [1 2 1] / 4 along each axis with mirrored ends: keeps the sum.
void smooth_histogram(const std::vector<float>& share, std::vector<float>* scratch, std::vector<float>* out);

}  // namespace sdftrack::appearance
