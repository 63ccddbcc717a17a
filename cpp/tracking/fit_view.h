// SPDX-License-Identifier: MIT
// One object in one frame, as a fit sees it: its pixels, the free space around it, and what a pose is judged
// by.
#pragma once

#include <optional>
#include <vector>

#include "optim/lm.h"
#include "tracking/color_evidence.h"
#include "tracking/correlation.h"
#include "tracking/local_noise.h"
#include "tracking/selection.h"
#include "tracking/trust.h"

namespace sdftrack {

struct TrackStep {
  LmStep step;
  double scale_m;
  int pixels;
};

// One record of every trial, in order.
inline void prepend(const std::vector<TrackStep>& first, std::vector<TrackStep>* steps) {
  steps->insert(steps->begin(), first.begin(), first.end());
}

// What a fit takes from the frames before and hands on to the next one.
struct FitMemory {
  double noise_factor = 1;  // sensor noise, measured over stated
  bool noise_known = false;
  double correlation_area_px = 0;  // 0: not measured yet
  int area_age = 0;                // frames since that was measured
  double damping = 0;              // only with TrackerOptions::keep_damping
};

// Whom to fit, and where it is expected: pixels are taken around `expected`, the prior is centred there.
struct FitTarget {
  const Shape& shape;
  Rigidd expected;  // T_cam_obj, centred frame
  Matrix6d prior;   // information of the prior on the increment of T_obj_cam; 0: none
  FitMemory memory;
  const ColorModel* colors = nullptr;    // nullptr: depth alone
  const Neighbors* neighbors = nullptr;  // nullptr: none
};

struct Fitted {
  Rigidd T_cam_obj;     // centred frame
  Matrix6d covariance;  // camera axes, about the caller's object origin
  double cost = 0;      // mean per pixel of the last stage; with colours that of depth where they are its own
  double foreground = -1;  // mean posterior of the colours on the surface; -1: no colours
  Visibility seen;
  Outline outline;
  double roughness = 1;  // see PoseEvidence
  double centre_sd = 0;  // likewise
  FitMemory memory;
  std::vector<TrackStep> steps;
};

class FitView {
 public:
  explicit FitView(const TrackerOptions& options) : options_(options) {}

  // Finds the pixels around the expected pose, and packs those of the coarse stages. The frame, the camera
  // and the target are kept by address. Returns how many there are.
  int open(const DepthFrame& frame, const Camera& camera, const FitTarget& target, double padding_m,
           const Plane* plane);
  void read_free_space(double padding_m);
  // Readings far from the surface at x have lost all weight at this scale: of the others as many as the
  // budget allows, into pixels().
  void choose_fine_pixels(double scale_m, const State& x);
  void pack(int wanted, PixelSet* out);
  // What choose_fine_pixels begins with: as many pixels as hold the budget of those near the surface.
  void keep_seen(const Rigidd& T_obj_cam, PixelSet* pixels) const;
  void pack_for_budget(double reach_m, const State& x);
  static double fine_reach_m(double scale_m);

  SdfEnergyOptions energy_options() const;
  double last_scale(const FitMemory& memory) const;
  void measure_noise(const EnergySummary& summary, FitMemory* memory) const;
  // Cost by colour, covariance: of pixels() at x.
  void measure_pose(const SdfEnergyOptions& options, const State& x, EnergySummary summary, SdfEnergy* energy,
                    Fitted* fitted);
  // Visible surface, outline, roughness. Readings on the surface of one of `others` say nothing of where this
  // object ends.
  void examine(const Neighbors& others, Fitted* fitted);
  void examine(Fitted* fitted);  // beside target().neighbors

  // The brightness of some of these pixels against that of the surface at x, and how much it weighs beside
  // all of them; 0: too few show a surface whose colours are known. Valid until the next call.
  PhotometricEnergy brightness(const PixelSet& pixels, const State& x, double* weight);

  const FitTarget& target() const { return *target_; }
  double stated_noise_m() const { return stated_noise_m_; }
  int candidates() const { return selection_.count(); }
  PixelSet& coarse() { return coarse_; }
  PixelSet& pixels() { return pixels_; }
  DistanceGrid& free_grid() { return free_grid_; }
  SummaryScratch& summary_scratch() { return summary_scratch_; }

 private:
  bool reads_colors() const { return target_->colors || uses_brightness(); }
  bool uses_brightness() const {
    return options_.photometric && frame_->color && target_->shape.colors.rgb_seen;
  }
  void add_brightness(const State& x, double scale_m, EnergySummary* summary);
  double correlation_area(const SdfEnergyOptions& options, const State& x, SdfEnergy* energy,
                          FitMemory* memory);

  TrackerOptions options_;

  const DepthFrame* frame_ = nullptr;
  const Camera* camera_ = nullptr;
  const FitTarget* target_ = nullptr;
  double stated_noise_m_ = 0;

  // Working memory, kept from frame to frame.
  PixelSelection selection_;
  PixelSet pixels_, coarse_, scratch_;
  FreeSpaceScratch free_scratch_;
  DistanceGrid free_grid_;
  CorrelationArea correlation_;
  ColorReader color_reader_;
  SummaryScratch summary_scratch_;
  std::vector<float> floats_;
  GreyPixels grey_;
  std::vector<PhotometricHit> photometric_hits_;
  NormalEquations photometric_;
};

}  // namespace sdftrack
