// SPDX-License-Identifier: MIT
// The colours on the two sides of an object's outline, by place on the object.
#pragma once

#include <array>
#include <vector>

#include "appearance/color_model.h"
#include "base/vec.h"

namespace sdftrack::appearance {

constexpr int kLocalBins = 8 * 8 * 8;

// Maps a bin of the whole object's histograms: half as fine along each channel, since a place has few pixels.
constexpr int local_bin(int bin) { return ((bin >> 9) & 7) << 6 | ((bin >> 5) & 7) << 3 | ((bin >> 1) & 7); }

// Two histograms for each of some places on the object. A place's densities are
//   (n(c) + kPseudoPixels p(c)) / (n + kPseudoPixels),
// n(c) the pixels of that colour seen there, with decaying weight for earlier frames, p the density of the
// whole object's histograms, which dominates where little has been seen.
class LocalColors {
 public:
  // Places are the cells of a cube about the object's centre, 4 x 4 on each side.
  static constexpr int kPerSide = 4, kPlaces = 6 * kPerSide * kPerSide;
  static constexpr float kPseudoPixels = 15;

  // Place of a point in the centred object frame.
  static int place_of(Vec3d p_obj);

  void forget() { places_.clear(); }
  bool known() const { return !places_.empty(); }

  // Starts a frame: the earlier counts of each place that it shows decay by `rate`.
  void open(float rate);
  void add(int place, bool object, int bin);

  // The probability that a colour at this place is the object's, with equal priors.
  float chance(const ColorModel& whole, int place, int bin) const {
    const Place& here = places_[place];
    const float f = density(here.object, here.object_pixels, whole.object_density(bin), bin);
    const float b = density(here.background, here.background_pixels, whole.background_density(bin), bin);
    return f / (f + b);
  }

  template <class Archive, class Self>
  static void visit(Archive& archive, Self& self) {
    auto& [places, frame, keep] = self;
    archive(places, frame, keep);
    archive.check(places.empty() || places.size() == kPlaces);
  }

 private:
  struct Place {
    int frame = 0;  // in which it was last seen
    float object_pixels = 0, background_pixels = 0;
    std::array<float, kLocalBins> object{}, background{};

    template <class Archive, class Self>
    static void visit(Archive& archive, Self& self) {
      auto& [met, object_px, background_px, own, others] = self;
      archive(met, object_px, background_px, own, others);
    }
  };
  // Density relative to a uniform distribution.
  static float density(const std::array<float, kLocalBins>& seen, float pixels, float whole, int bin) {
    return (kLocalBins * seen[local_bin(bin)] + kPseudoPixels * whole) / (pixels + kPseudoPixels);
  }

  std::vector<Place> places_;
  int frame_ = 0;
  float keep_ = 0;
};

}  // namespace sdftrack::appearance
