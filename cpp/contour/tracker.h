// SPDX-License-Identifier: MIT
// A deforming object in a colour video, by its contour (thesis 6.3; Bibby and Reid, ECCV 2008;
// docs/math/contour.md).
#pragma once

#include <string>
#include <vector>

#include "contour/evolution.h"
#include "contour/redetection.h"
#include "contour/registration.h"

namespace sdftrack::contour {

enum class ContourStatus { kOk, kWeak, kLost };

// What a frame says about itself.
struct ContourReport {
  ContourStatus status = ContourStatus::kOk;
  double confidence = 1;  // 0 .. 1
  const char* reason = "";
  // Of which it is made: mean posterior inside less that beside the contour; how far the colours inside are
  // those at the start; how much of the outline before and after this frame is the same; mean log f in the
  // band.
  double contrast = 1, likeness = 1, overlap = 1, mean_log = 0;
};

class ContourTracker {
 public:
  explicit ContourTracker(const ContourOptions& options);

  // Throws std::invalid_argument where the mask (or box) has next to no pixels, or leaves none; what was
  // tracked before is then tracked on.
  void start(const RgbView& image, const unsigned char* mask);
  void start(const RgbView& image, const ImagePart& box);

  // Where the object is in the next image, and its shape; nothing is learned yet.
  void observe(const RgbView& image);
  // Drift correction, and the histograms if the frame is to be learned from.
  void finish(bool learn);

  // Another shape in place of the one found: negative inside, made a distance here.
  void replace_shape(const float* phi);

  // The posterior at every cell of the grid where it lies now, also far from the outline; one half beyond the
  // image.
  void look_at_all(const RgbView& image, float* foreground);

  const ContourGrid& grid() const { return grid_; }
  const ContourReport& report() const { return report_; }
  const ContourOptions& options() const { return options_; }
  const PosteriorImage& posterior() const { return posterior_; }
  bool started() const { return started_; }
  // One byte per pixel, 0 or 1; where the grid does not reach, 0.
  void write_mask(const RgbView& image, unsigned char* mask) const;

 private:
  static constexpr int kMinPixels = 30;   // an object of fewer has no colours to speak of
  static constexpr int kMinRing_px = 12;  // of background around it
  static constexpr int kBlur = 2;         // cells, to each side

  template <class Place>
  void start_anew(const RgbView& image, const Place& place);
  void start_here(const RgbView& image, const unsigned char* mask);
  void start_here(const RgbView& image, const ImagePart& box);
  std::string unfit(const RgbView& image, int pixels) const;
  void make_grid(const ImagePart& box);
  void segment_box(const RgbView& image, const ImagePart& box);
  void begin(const RgbView& image);
  void make_room(const RgbView& image);
  void shape(int steps);
  void judge(const RgbView& image);
  void find_hidden();
  void look_behind();
  float mean_posterior(int x, int y) const;
  void recentre();
  bool look_around(const RgbView& image);
  int reach_cells() const;
  CellBox near_cells() const;
  void place(const RgbView& image);

  ContourOptions options_;
  RegionModel model_;
  ContourGrid grid_;
  PosteriorImage posterior_;
  RegistrationWork registration_;
  EvolutionWork evolution_;
  ShapeSamples samples_;
  RedetectionWork redetection_;
  ContourReport report_;
  std::vector<float> before_, resampled_;  // phi before this frame's steps
  std::vector<float> seen_;            // what was seen, where a whole shape stands in its place; else empty
  std::vector<unsigned char> hidden_;  // cells that were not seen, and those beside them
  std::vector<float> good_phi_;        // the shape when it was last sure, and its warp
  GridWarp good_warp_;
  CellBox good_inside_{0, 0, 0, 0};
  double first_area_ = 0;  // cells
  int inside_ = 0;         // cells
  double usual_contrast_ = 0, first_contrast_ = 1;
  bool counted_ = false;
  int lost_frames_ = 0;  // in a row
  bool started_ = false;
};

}  // namespace sdftrack::contour
