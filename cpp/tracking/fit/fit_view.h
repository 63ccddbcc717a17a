// SPDX-License-Identifier: MIT
// One object in one frame: its pixels, the free space around it, and the evidence about a pose.
#pragma once

#include <algorithm>
#include <optional>
#include <vector>

#include "frame/selection.h"
#include "optim/lm.h"
#include "tracking/fit/correlation.h"
#include "tracking/fit/local_noise.h"
#include "tracking/fit/outline_lines.h"
#include "tracking/fit/outline_noise.h"
#include "tracking/size/outline_size.h"
#include "tracking/trust/color_delay.h"
#include "tracking/trust/color_evidence.h"
#include "tracking/trust/smooth_foreground.h"
#include "tracking/trust/systematic.h"
#include "tracking/trust/trust.h"

namespace sdftrack::tracking {

struct TrackStep {
  optim::LmStep step;
  double scale_m;
  int pixels;

  template <class Archive, class Self>
  static void visit(Archive& archive, Self& self) {
    auto& [one, scale, count] = self;
    auto& [cost, damping, accepted] = one;
    archive(cost, damping, accepted, scale, count);
  }
};

// Joins the records of all trials, in order.
inline void prepend(const std::vector<TrackStep>& first, std::vector<TrackStep>* steps) {
  steps->insert(steps->begin(), first.begin(), first.end());
}

// What a fit takes from earlier frames and passes on to the next one.
struct FitMemory {
  double noise_factor = 1;  // sensor noise, measured over stated
  bool noise_known = false;
  double correlation_area_px = 0;  // 0: not measured yet
  int area_age = 0;                // frames since that was measured
  double systematic_m = 0;         // measured sd of the depth error that a surface's measurements share
  bool learns_systematic = false;  // in the next frame: its pose was given
  int search_pause = 0;            // frames in which no search may help a fit: the last one was in vain
  OutlineNoise outline{};          // 0: not measured yet
  double shared_m = 0;             // recent sd of the common error of the depth measurements
  int outline_age = 0;             // frames since the outline was last evaluated
  int form_age = 0;                // size evaluations since the last one of the form
  int size_turns = 0;              // see is_turn_for_size
  BiasSums bias{};                 // of the last frames

  template <class Archive, class Self>
  static void visit(Archive& archive, Self& self) {
    auto& [noise, known, area_px, age, systematic, learns, pause, lines, shared, lines_age, form_age, turns,
           sums] = self;
    archive(noise, known, area_px, age, systematic, learns, pause, lines, shared, lines_age, form_age, turns,
            sums);
  }
};

// The object to fit and its expected pose: pixels are taken around `expected`, the prior is centred there.
struct FitTarget {
  const frame::Shape& shape;
  Rigidd expected;  // T_cam_obj, centred frame
  Matrix6d prior;   // information of the prior on the increment of T_obj_cam; 0: none
  FitMemory memory;
  const appearance::ColorModel* colors = nullptr;  // nullptr: depth alone
  const Neighbors* neighbors = nullptr;            // nullptr: none
  OutlineColors outline{};
};

struct Fitted {
  Rigidd T_cam_obj;     // centred frame
  Matrix6d covariance;  // camera axes, about the caller's object origin
  // What errors of distance and time that no residual shows add to the reported covariance.
  Matrix6d unseen_errors = Matrix6d::Zero();
  // The part of the covariance due to errors that neighbouring measurements share.
  Matrix6d systematic_errors = Matrix6d::Zero();
  double cost = 0;  // mean per pixel of the last stage; with colours that of depth on the object's pixels
  double foreground = -1;  // mean posterior of the colours on the surface; -1: no colours
  Visibility seen;
  Outline outline;
  double roughness = 1;             // see PoseEvidence
  double centre_sd = 0;             // see PoseEvidence
  double systematic_m = 0;          // that the covariance assumes
  std::optional<PosesApart> apart;  // in frames whose outline was evaluated
  // Only in frames where they were requested.
  std::optional<SizeLook> size_by_depth;
  std::optional<StrainLook> form_by_depth;
  std::optional<OutlineLook> by_outline;
  FitMemory memory;
  std::vector<TrackStep> steps;
};

class FitView {
 public:
  explicit FitView(const TrackerOptions& options) : options_(options) {}

  // Finds the pixels around the expected pose, and packs those of the coarse stages. The frame, the camera
  // and the target are kept by address. Returns the number of pixels.
  int open(const frame::DepthFrame& frame, const Camera& camera, const FitTarget& target, double padding_m,
           const frame::Plane* plane);
  // The same for a fit that uses no depth.
  void open_without_depth(const frame::DepthFrame& frame, const Camera& camera, const FitTarget& target);
  void read_free_space(double padding_m);
  // Measurements far from the surface at x have no weight at this scale: packs the others, as many as the
  // budget allows, into pixels().
  void choose_fine_pixels(double scale_m, const optim::State& x);
  void pack(int requested, energies::PixelSet* out);
  // distance_m: from the surface at a nearly correct pose, or nullptr; beyond reach_m nothing is smoothed.
  void smooth_foreground(const float* distance_m, double reach_m, energies::PixelSet* pixels);
  void keep_seen(const Rigidd& T_obj_cam, energies::PixelSet* pixels) const;
  // Packs so many pixels that those near the surface fill the budget.
  void pack_for_budget(double reach_m, const optim::State& x);
  static double fine_reach_m(double scale_m);

  energies::SdfEnergyOptions energy_options() const;
  double last_scale(const FitMemory& memory) const;
  void measure_noise(const energies::EnergySummary& summary, FitMemory* memory) const;
  // Cost by colour and covariance, of pixels() at x.
  void measure_pose(const energies::SdfEnergyOptions& options, const optim::State& x,
                    energies::EnergySummary summary, energies::SdfEnergy* energy, Fitted* fitted);
  // Visible surface, outline, roughness. Measurements on one of `others` do not show where this object ends.
  void examine(const Neighbors& others, Fitted* fitted);
  void examine(Fitted* fitted);  // next to target().neighbors

  // Compares the brightness of some of these pixels with that of the surface at x; `weight`: relative to all
  // pixels, 0 where too few show a surface of known colour. Valid until the next call.
  energies::PhotometricEnergy brightness(const energies::PixelSet& pixels, const optim::State& x,
                                         double* weight);

  // Reads the outline in the colour image as seen from T_cam_obj; none without colours, or where the options
  // exclude it. Valid until the next call. Returns the number of places evaluated.
  int read_outline(const Rigidd& T_cam_obj, int reach_px);
  // Neighbours next to which an outline is not used, from now on; kept by address. Initially the target's.
  void set_neighbors(const Neighbors* neighbors) { neighbors_ = neighbors; }
  // Learns the colours on both sides of the outline at T_cam_obj, which must be reliable.
  void learn_outline(const frame::DepthFrame& frame, const Camera& camera, const frame::Shape& shape,
                     const appearance::ColorModel& whole, const Rigidd& T_cam_obj, const FitMemory& memory,
                     appearance::LocalColors* colors);
  // Whether the outline is used in addition to depth: where depth has a common error or disagrees with the
  // outline, or where this is not known yet.
  bool outline_helps() const {
    const FitMemory& memory = target_->memory;
    return reads_outline() && (!memory.noise_known ||
                               std::max(memory.shared_m, memory.outline.apart_m) >= options_.outline_from_m);
  }
  bool reads_outline() const { return options_.outline && frame_->color && target_->outline.whole; }
  // Covariance and noise from the outline alone.
  void measure_outline_pose(const optim::State& x, Fitted* fitted);
  const energies::OutlineLines& outline_lines() const { return outline_lines_; }
  energies::OutlineEnergy outline_energy(const FitMemory& memory, double common_sd_px);
  // The weight of each line relative to the pixels, many of which share an error too; 0: too few lines.
  double outline_weight(const FitMemory& memory) const;

  static double shared_lines(const FitMemory& memory);
  static double outline_factor(const FitMemory& memory) {
    return memory.outline.factor > 0 ? memory.outline.factor : 1;
  }

  const FitTarget& target() const { return *target_; }
  double stated_noise_m() const { return stated_noise_m_; }
  int candidates() const { return selection_.count(); }
  energies::PixelSet& coarse() { return coarse_; }
  energies::PixelSet& pixels() { return pixels_; }
  energies::DistanceGrid& free_grid() { return free_grid_; }
  energies::SummaryScratch& summary_scratch() { return summary_scratch_; }

 private:
  bool reads_colors() const { return target_->colors || uses_brightness(); }
  bool uses_brightness() const {
    return options_.photometric && frame_->color && target_->shape.colors.rgb_seen;
  }
  void add_brightness(const optim::State& x, double scale_m, energies::EnergySummary* summary);
  energies::EnergySummary by_form(const optim::State& x, energies::EnergySummary summary,
                                  const Matrix6d& depth_geometry) const;
  void measure_outline(const optim::State& x, FitMemory* memory);
  // Compares depth and outline, with the weight that the outline had in the fit; 0: it was not used.
  void compare_with_outline(const optim::State& x, double area_px, const energies::EnergySummary& depth,
                            double weight, FitMemory* memory);
  Vector6d way_to_its_minimum(const optim::State& x, energies::OutlineEnergy* outline);
  void compare_outline_now_and_then(const optim::State& x, double area_px,
                                    const energies::EnergySummary& depth, FitMemory* memory);
  void add_outline(const optim::State& x, double scale_m, double* area_px, energies::EnergySummary* summary,
                   FitMemory* memory);
  int budget_for(double reach_m, const optim::State& x);
  void add_systematic(double systematic_m, Fitted* fitted) const;
  void look_at_size(double noise_m, double systematic_m, Fitted* fitted) const;
  double correlation_area(const energies::SdfEnergyOptions& options, const optim::State& x,
                          energies::SdfEnergy* energy, FitMemory* memory);

  TrackerOptions options_;

  const frame::DepthFrame* frame_ = nullptr;
  const Camera* camera_ = nullptr;
  const FitTarget* target_ = nullptr;
  const Neighbors* neighbors_ = nullptr;
  double stated_noise_m_ = 0;

  // What the covariance of the last measured pose was made of.
  struct MeasuredPose {
    bool known = false;
    energies::EnergySummary sums;
    Matrix6d depth_information;  // the part of sums.A from the pixels' depths
    Rigidd T_obj_cam;
    energies::DepthLogistic<float> penalty;
    float color_prior;
  } measured_;

  // Working memory, kept from frame to frame.
  frame::PixelSelection selection_;
  energies::PixelSet pixels_, coarse_, scratch_;
  frame::FreeSpaceScratch free_scratch_;
  energies::DistanceGrid free_grid_;
  CorrelationArea correlation_;
  ColorReader color_reader_;
  ForegroundSmoother smoother_;
  energies::SummaryScratch summary_scratch_;
  std::vector<float> floats_;
  energies::GreyPixels grey_;
  std::vector<energies::PhotometricHit> photometric_hits_;
  optim::NormalEquations photometric_, outline_there_;
  optim::State outline_at_;
  std::optional<PosesApart> apart_;
  std::optional<OutlineLook> by_outline_;
  ContourLibrary contours_;
  energies::OutlineLines outline_lines_;
  std::vector<energies::OutlineResidual> outline_residuals_;
};

}  // namespace sdftrack::tracking
