// SPDX-License-Identifier: MIT
// The colours of the object and of its surroundings, by place on the grid.
#pragma once

#include <type_traits>
#include <vector>

#include "contour/options.h"
#include "contour/region.h"

namespace sdftrack::contour {

// The posterior of the object at each pixel of a rectangle of the image; one half where nothing is known.
struct PosteriorImage {
  ImagePart rect{0, 0, 0, 0};
  std::vector<float> foreground;

  const float* row(int y) const { return foreground.data() + std::ptrdiff_t(y - rect.y0) * rect.width(); }
  float at(int x, int y) const { return row(y)[x - rect.x0]; }
};

constexpr float kMinPosterior = 0.018f;  // of either class at a pixel: no single colour is decisive

// Two histograms, object and background, for each of K x K windows spread over the grid: a pixel counts in
// the four nearest by bilinear weights, and its posterior is that of their mixture. Each window's shares are
// shrunk towards those of all windows together: (n_kc + m p_c) / (N_k + m).
class RegionModel {
 public:
  explicit RegionModel(const ContourOptions& options);

  // Pools in the histograms of this image; a rate of 1 replaces them. Returns false, and changes nothing, if
  // the contour holds next to no pixels of the image, or leaves none outside.
  bool learn(const RgbView& image, const ContourGrid& grid, double object_rate, double background_rate);
  // Over the pixels of these cells. `only_known`: one half for colours that are almost never seen on either
  // side. Otherwise such colours are attributed to the side with fewer pixels in a window.
  void posterior(const RgbView& image, const ContourGrid& grid, const CellBox& cells, PosteriorImage* out,
                 bool only_known = false) const;
  // Uses the shared histograms alone, for finding the object anywhere.
  void posterior_anywhere(const RgbView& image, const ImagePart& rect, PosteriorImage* out) const;
  // As posterior_anywhere, the mean of up to four pixels per square of `stride` pixels; out->rect: squares.
  void posterior_of_squares(const RgbView& image, const ImagePart& part, int stride,
                            PosteriorImage* out) const;
  // The object's colours at the time of `remember`, compared with those in the last frame that was counted:
  // sum of sqrt(p q), 1 for equal colours.
  void remember();
  double likeness() const { return likeness_; }
  // Without object windows the object's colours are the same everywhere on the grid.
  void object_windows(bool yes) { object_windows_ = yes, make_shares(); }
  // Counts an image's colours without learning them; likeness() then refers to this image.
  bool count(const RgbView& image, const ContourGrid& grid);
  // Pools the last counted colours into the histograms.
  void pool(double object_rate, double background_rate);

  template <class Archive, class Self>
  static void visit(Archive& archive, Self& self) {
    auto& [bins, shift, windows, shared_only, object_windows, known, shrink, pool, least, stride, slots, used,
           counts, fresh, shares, whole, totals, remembered, likeness] = self;
    archive(object_windows, known, slots, used, counts, shares, whole, remembered, likeness);
    if constexpr (!std::is_const_v<Self>) fresh.resize(counts.size());  // of one frame
    archive.check(self.fits());
  }

 private:
  // Whether all stored arrays and slots match these colours and windows.
  bool fits() const;
  int bin_of(const unsigned char* rgb) const {
    return ((rgb[0] >> shift_) * bins_ + (rgb[1] >> shift_)) * bins_ + (rgb[2] >> shift_);
  }
  int slot_of(int bin);
  // From the shared histograms; one half for a colour never seen.
  float posterior_of(const unsigned char* rgb) const;
  bool known(int slot) const;
  void make_shares();
  double floor_share() const;

  int bins_, shift_, windows_;
  bool shared_only_;
  bool object_windows_ = true, known_ = false;
  double shrink_;
  OpinionPool pool_;
  float least_;
  int stride_;              // numbers of a colour: windows_^2 pairs of object and background
  std::vector<int> slots_;  // by bin; -1: never seen
  int used_ = 0;            // slots
  std::vector<float> counts_, fresh_, shares_;  // [slot][window][object, background]
  std::vector<float> whole_;                    // [slot][object, background]: shares of all windows together
  std::vector<double> totals_;                  // [window][object, background]
  std::vector<float> remembered_;               // [slot]: object's share
  double likeness_ = 1;
};

}  // namespace sdftrack::contour
