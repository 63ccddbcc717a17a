// SPDX-License-Identifier: MIT
// Tracks a deforming object in a colour video by its contour (thesis 6.3; docs/math/contour.md).
#pragma once

#include <string>
#include <vector>

#include "base/state_archive.h"
#include "contour/evolution.h"
#include "contour/motion_odds.h"
#include "contour/redetection.h"
#include "contour/registration.h"
#include "contour/results.h"
#include "contour/shared_colors.h"

namespace sdftrack::contour {

class ContourTracker {
 public:
  explicit ContourTracker(const ContourOptions& options, int device = -1);

  // Throws std::invalid_argument if the mask (or box) has next to no pixels, or leaves none outside; an
  // object tracked before is then tracked on.
  ContourFrame start(const RgbView& image, const unsigned char* mask);
  ContourFrame start(const RgbView& image, const ImagePart& box);

  // A frame without a memory: observe and finish. `flow`: from this image to the last one; nullptr: none.
  ContourFrame track(const RgbView& image, const FlowView* flow = nullptr);

  // A frame with a memory is three calls. First, where the object is in the next image, and its shape.
  ContourObservation observe(const RgbView& image, const FlowView* flow = nullptr);
  // Second, if the memory needs it: the posterior at every cell of the grid at its current place, also far
  // from the outline; one half beyond the image.
  std::span<const float> posterior_on_grid(const RgbView& image);
  // Third, the memory's judgement, and the whole silhouette that replaces the shape if it recovered one
  // (cells, not 0: inside; nullptr, or nothing inside: the shape stays).
  ContourFrame finish(ShapeJudgement judgement, const unsigned char* recovered = nullptr);

  const ContourGrid& grid() const { return grid_; }
  const ContourReport& report() const { return report_; }
  const ContourOptions& options() const { return options_; }

  // For state_of and set_state: all that the results for the next images depend on, without the options.
  template <class Archive, class Self>
  static void visit(Archive& archive, Self& self) {
    auto& [options, model, grid, posterior, registration, evolution, samples, redetection, own_pairs,
           other_pairs, motion, shared_colors, report, before, resampled, seen, hidden, good_phi, good_warp,
           good_inside, first_area, inside, usual_contrast, first_contrast, counted, lost_frames, width,
           height, mask] = self;
    archive(model, grid, report, seen, good_phi, good_warp, good_inside, first_area, inside, usual_contrast,
            first_contrast, counted, lost_frames);
    archive.check((seen.empty() || grid.holds(seen)) && grid.holds(good_phi));
    archive.check(good_phi.empty() || good_inside.lies_on(grid.nx, grid.ny));
  }

 private:
  static constexpr int kMinPixels = 30;     // with fewer pixels an object has no reliable colours
  static constexpr int kMinRing_px = 12;    // of background around it
  static constexpr int kBlur = 2;           // cells, to each side
  static constexpr float kMinPart = 0.01f;  // of the largest piece; smaller ones are noise of the colours

  template <class Place>
  ContourFrame start_anew(const RgbView& image, const Place& place);
  void start_here(const RgbView& image, const unsigned char* mask);
  void start_here(const RgbView& image, const ImagePart& box);
  std::string unfit(const RgbView& image, int pixels) const;
  void make_grid(const ImagePart& box);
  void segment_box(const RgbView& image, const ImagePart& box);
  void begin(const RgbView& image);
  void make_room(const RgbView& image);
  void shape(int steps);
  void judge(const RgbView& image);
  void look_beside(const RgbView& image);
  void find_hidden();
  void look_behind();
  float mean_posterior(int x, int y) const;
  void replace_shape(const unsigned char* inside);
  void recentre();
  bool look_around(const RgbView& image);
  int reach_cells() const;
  CellBox near_cells() const;
  void place(const RgbView& image);
  void follow(const RgbView& image, const FlowView* flow);
  void weigh_motion(const FlowView* flow);
  void see(const RgbView& image, const CellBox& cells);
  void draw_mask();
  ContourShape shape_now() const;
  ContourFrame frame();

  ContourOptions options_;
  RegionModel model_;
  ContourGrid grid_;
  PosteriorImage posterior_;
  RegistrationWork registration_;
  EvolutionWork evolution_;
  ShapeSamples samples_;
  RedetectionWork redetection_;
  MotionPairs own_pairs_, other_pairs_;
  MotionCue motion_;
  SharedColorsWork shared_colors_;
  ContourReport report_;
  std::vector<float> before_, resampled_;  // phi before this frame's steps
  std::vector<float> seen_;                // the visible shape, where a whole shape replaces it; else empty
  std::vector<unsigned char> hidden_;      // cells that were not visible, and cells next to them
  std::vector<float> good_phi_;            // the shape when it was last sure
  GridWarp good_warp_;
  CellBox good_inside_{0, 0, 0, 0};
  double first_area_ = 0;  // cells
  int inside_ = 0;         // cells
  double usual_contrast_ = 0, first_contrast_ = 1;
  bool counted_ = false;
  int lost_frames_ = 0;  // in a row
  int width_ = 0, height_ = 0;
  std::vector<unsigned char> mask_;
};

}  // namespace sdftrack::contour
