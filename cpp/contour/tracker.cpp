// SPDX-License-Identifier: MIT
#include "contour/tracker.h"

#include <algorithm>
#include <cmath>

#include "contour/tracker_limits.h"

namespace sdftrack {

namespace {

constexpr float kBeyondBand = 4;                 // cells of distance beside the band, for what moves
constexpr double kJumpGain = 0.1;                // contrast that a jump must gain over staying
constexpr double kSure = 0.55, kDoubtful = 0.3;  // confidence
constexpr double kMostGrowth = 1.5;              // of the scale in a frame
constexpr int kJumpStep_px = 6;
constexpr double kSuspicious = 0.8;  // of the usual contrast
constexpr int kPosteriorMargin = 4;  // cells that registration may move the band by

}  // namespace

ContourTracker::ContourTracker(const ContourOptions& options) : options_(options), model_(options) {
  options.check();
}

int ContourTracker::reach_cells() const { return static_cast<int>(std::ceil(options_.band + kBeyondBand)); }

// Steps of the level set, its pieces, and its distance again.
void ContourTracker::shape(int steps) {
  find_band(grid_, options_.band, &evolution_.band);
  sample_posterior(grid_, posterior_, &evolution_);
  evolve_contour(options_, steps, &evolution_, &grid_);
  inside_ = drop_small_pieces(options_.least_part, reach_cells(), &evolution_, &grid_);
  redistance(reach_cells(), &evolution_.distance, &grid_);
}

void ContourTracker::observe(const RgbView& image) {
  if (report_.status == ContourStatus::kLost && !look_around(image)) return;
  before_ = seen_.empty() ? grid_.phi : seen_;
  find_hidden();
  const GridWarp last = grid_.warp;
  place(image);
  // Less convincing than before: it may have jumped.
  if (options_.reach > 0 && report_.contrast < kSuspicious * usual_contrast_) {
    const GridWarp settled = grid_.warp;
    const double contrast = report_.contrast;
    grid_.warp = last;
    model_.posterior(image, grid_, grid_.all(), &posterior_);
    search_place(samples_, posterior_, static_cast<int>(options_.reach), kJumpStep_px, &grid_.warp);
    place(image);
    if (report_.contrast < contrast + kJumpGain) {
      grid_.warp = settled;
      model_.posterior(image, grid_, near_cells(), &posterior_);
    }
  }
  if (!seen_.empty()) look_behind();
  shape(options_.shape_steps);
  judge(image);
}

CellBox ContourTracker::near_cells() const {
  return grid_.inside.grown(reach_cells() + kPosteriorMargin, grid_.nx, grid_.ny);
}

// Posterior, registration, and the contrast there.
void ContourTracker::place(const RgbView& image) {
  model_.posterior(image, grid_, near_cells(), &posterior_);
  const unsigned char* const hidden = seen_.empty() ? nullptr : hidden_.data();
  choose_pixels(grid_, posterior_, options_.band, hidden, &registration_);
  const GridWarp before = grid_.warp;
  register_grid(options_, &registration_, &grid_);
  // Where nothing holds it, a contour may shrink to nothing or blow up: then it stays.
  const double grown = grid_.warp.scale() / before.scale();
  if (!(grown > 1 / kMostGrowth && grown < kMostGrowth)) grid_.warp = before;
  choose_samples(grid_, options_.band, hidden, &samples_);
  report_.contrast = contrast_at(samples_, grid_.warp, posterior_);
}

void ContourTracker::judge(const RgbView& image) {
  std::size_t both = 0, either = 0;
  for (std::size_t i = 0; i < before_.size(); ++i) {
    const bool a = before_[i] < 0, b = grid_.phi[i] < 0;
    both += a && b, either += a || b;
  }
  report_.overlap = either > 0 ? static_cast<double>(both) / static_cast<double>(either) : 0;
  choose_samples(grid_, options_.band, nullptr, &samples_);
  report_.contrast = inside_ > 0 ? contrast_at(samples_, grid_.warp, posterior_) : 0;
  report_.mean_log = registration_.u.empty() ? -1 : -registration_.record.cost / registration_.record.count;
  counted_ = model_.count(image, grid_);
  if (!counted_) report_.contrast = 0;
  usual_contrast_ += 0.05 * (report_.contrast - usual_contrast_);
  report_.likeness = model_.likeness();
  const double contrast = std::clamp(report_.contrast / first_contrast_, 0.0, 1.0);
  report_.confidence = contrast * report_.likeness;
  const bool was_lost = report_.status == ContourStatus::kLost;
  if (report_.confidence >= kSure && inside_ >= kLeastPixels) {
    report_.status = ContourStatus::kOk, report_.reason = "";
    lost_frames_ = 0;
  } else if (report_.confidence >= (was_lost ? kSure : kDoubtful) && inside_ >= kLeastPixels) {
    report_.status = ContourStatus::kWeak;
    report_.reason = contrast < report_.likeness
                         ? "colours inside and beside the outline differ less than at the start"
                         : "colours inside the outline are no longer those at the start";
  } else {
    report_.status = ContourStatus::kLost;
    report_.reason =
        "neither the colours inside nor those beside the outline are the object's and its surroundings'";
    ++lost_frames_;
  }
}

void ContourTracker::finish(bool learn) {
  if (report_.status == ContourStatus::kLost) return;
  // The whole shape, be it seen or remembered; half of one is not what to look for when it is lost.
  if (report_.status == ContourStatus::kOk && (learn || !seen_.empty()))
    good_phi_ = grid_.phi, good_warp_ = grid_.warp, good_inside_ = grid_.inside;
  recentre();
  if (learn && report_.status == ContourStatus::kOk && counted_)
    model_.pool(static_cast<double>(options_.object_rate), static_cast<double>(options_.background_rate));
}

void ContourTracker::write_mask(const RgbView& image, unsigned char* mask) const {
  // What is lost is nowhere.
  std::fill_n(mask, static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height),
              static_cast<unsigned char>(0));
  if (report_.status == ContourStatus::kLost) return;
  const FlatView view{grid_.phi.data(), grid_.nx, grid_.ny};
  each_row_on(grid_, grid_.inside.grown(1, grid_.nx, grid_.ny),
              rect_of(grid_, grid_.inside.grown(1, grid_.nx, grid_.ny), image),
              [&](int y, int xa, int xb, double gx, double gy, double dx, double dy) {
                unsigned char* const to = mask + static_cast<std::ptrdiff_t>(y) * image.width;
                for (int x = xa; x < xb; ++x, gx += dx, gy += dy) {
                  float phi, unused_x, unused_y;
                  sample_flat(view, static_cast<float>(gx), static_cast<float>(gy), &phi, &unused_x,
                              &unused_y);
                  to[x] = phi < 0;
                }
              });
}

}  // namespace sdftrack
