// SPDX-License-Identifier: MIT
#include "contour/tracker.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/to_int.h"

namespace sdftrack::contour {

namespace {

constexpr float kBeyondBand = 4;                 // cells of distance beyond the band, for motion
constexpr double kJumpGain = 0.1;                // contrast that a jump must gain over no jump
constexpr double kSure = 0.55, kDoubtful = 0.3;  // confidence
constexpr double kFound = 0.4;                   // of the first contrast, for accepting a place
constexpr double kFoundFar = 0.7;                // the same in the whole image, where more places look alike
constexpr int kPatience = 2;                     // frames of search around the last place alone: occluders
                                                 // may pass
constexpr double kMaxGrowth = 1.5;               // of the scale in a frame
constexpr int kJumpStep_px = 6;
constexpr double kSuspicious = 0.8;      // of the usual contrast
constexpr double kFullTrust_px2 = 6000;  // a smaller object is blurred in the flow
constexpr int kHiddenMargin = 6;         // cells that an occluder may move by in a frame
constexpr int kPosteriorMargin = 4;      // cells that registration may move the band by
constexpr int kShapeSteps = 5;           // of the level set in a frame, for the deformation in it
// much: smaller limits would resample the shape, and blur it, in most frames.
constexpr double kDriftCells = 3, kDriftLogScale = double(0.05f);

constexpr double kSharedFades = 0.995;  // per frame

}  // namespace

const char* sentence(ContourReason reason) {
  switch (reason) {
    case ContourReason::kSidesAlike:
      return "the colours on either side of the outline differ less than at the start";
    case ContourReason::kOtherColors:
      return "the colours inside the outline no longer match those at the start";
    case ContourReason::kNoMatch:
      return "the colours match neither the object inside the outline nor its surroundings outside it";
    default:
      return "";
  }
}

ContourTracker::ContourTracker(const ContourOptions& options, int device)
    : options_(options), model_(options) {
  options.check();
  evolution_.device = device;
}

int ContourTracker::reach_cells() const { return to_int(std::ceil(options_.band + kBeyondBand)); }

// Mean over 5 x 5 cells, which have been sampled.
float ContourTracker::mean_posterior(int x, int y) const {
  float sum = 0;
  for (int j = -kBlur; j <= kBlur; ++j)
    for (int i = -kBlur; i <= kBlur; ++i) sum += evolution_.foreground[(y + j) * grid_.nx + x + i];
  return sum / float((2 * kBlur + 1) * (2 * kBlur + 1));
}

// Steps of the level set, removal of small pieces, and the distance again.
void ContourTracker::shape(int steps) {
  find_band(grid_, options_.band, &evolution_.band);
  sample_posterior(grid_, posterior_, &evolution_);
  evolve_contour(options_, steps, &evolution_, &grid_);
  inside_ = drop_small_pieces(kMinPart, reach_cells(), &evolution_, &grid_);
  redistance(reach_cells(), &evolution_.distance, &grid_);
}

ContourFrame ContourTracker::track(const RgbView& image, const FlowView* flow) {
  follow(image, flow);
  return finish(ShapeJudgement::kNone);
}

ContourObservation ContourTracker::observe(const RgbView& image, const FlowView* flow) {
  follow(image, flow);
  return {report_, shape_now()};
}

void ContourTracker::follow(const RgbView& image, const FlowView* flow) {
  width_ = image.width, height_ = image.height;
  const bool was_lost = report_.status == ContourStatus::kLost;
  if (was_lost && !look_around(image)) return;
  before_ = seen_.empty() ? grid_.phi : seen_;
  find_hidden();
  const GridWarp last = grid_.warp;
  weigh_motion(was_lost ? nullptr : flow);
  place(image);
  // A lower contrast than before: it may have jumped.
  if (options_.reach > 0 && report_.contrast < kSuspicious * usual_contrast_) {
    const GridWarp settled = grid_.warp;
    const double contrast = report_.contrast;
    grid_.warp = last;
    see(image, grid_.all());
    search_place(samples_, posterior_, to_int(options_.reach), kJumpStep_px, &grid_.warp);
    place(image);
    if (report_.contrast < contrast + kJumpGain) {
      grid_.warp = settled;
      see(image, near_cells());
    }
  }
  if (!seen_.empty()) look_behind();
  motion_.flow.back = nullptr;  // the array belongs to the caller
  shape(kShapeSteps);
  judge(image);
}

// Finds the hidden cells that are visible now by their colours: no outline nearby could move.
void ContourTracker::look_behind() {
  seen_.clear();
  find_band(grid_, std::numeric_limits<float>::max(), &evolution_.band);
  evolution_.foreground.assign(grid_.phi.size(), 0.5f);
  sample_posterior(grid_, posterior_, &evolution_);
  for (int y = kBlur; y + kBlur < grid_.ny; ++y)
    for (int x = kBlur; x + kBlur < grid_.nx; ++x) {
      const auto cell = std::size_t(y * grid_.nx + x);
      if (hidden_[cell] && grid_.phi[cell] < 0 && mean_posterior(x, y) < 0.5f) grid_.phi[cell] = 0.5f;
    }
  redistance(reach_cells(), &evolution_.distance, &grid_);
}

// The cells of the whole shape that were hidden in the last frame, and those next to them.
void ContourTracker::find_hidden() {
  if (seen_.empty()) return;
  hidden_.assign(grid_.phi.size(), 0);
  const CellBox box = grid_.inside.grown(0, grid_.nx, grid_.ny);
  for (int y = box.y0; y <= box.y1; ++y)
    for (int x = box.x0; x <= box.x1; ++x) {
      const auto cell = std::size_t(y * grid_.nx + x);
      if (!(grid_.phi[cell] < 0 && seen_[cell] >= 0)) continue;
      const CellBox near = CellBox{x, y, x, y}.grown(kHiddenMargin, grid_.nx, grid_.ny);
      for (int j = near.y0; j <= near.y1; ++j)
        std::fill(hidden_.begin() + j * grid_.nx + near.x0, hidden_.begin() + j * grid_.nx + near.x1 + 1, 1);
    }
}

// Weighs each pixel by how much likelier its motion is the object's than the surroundings'. A part filled in
// by a memory does not move as the image there.
void ContourTracker::weigh_motion(const FlowView* flow) {
  motion_.flow.back = nullptr;
  if (!flow || !seen_.empty()) return;
  if (!fit_motions(*flow, grid_, &own_pairs_, &other_pairs_, &motion_)) motion_.flow.back = nullptr;
  motion_.trust = std::min(1.0, inside_ * std::abs(grid_.warp.determinant()) / kFullTrust_px2);
}

void ContourTracker::see(const RgbView& image, const CellBox& cells) {
  model_.posterior(image, grid_, cells, &posterior_);
  if (motion_.flow.back) weigh_by_motion(motion_, kMinPosterior, &posterior_);
}

CellBox ContourTracker::near_cells() const {
  return grid_.inside.grown(reach_cells() + kPosteriorMargin, grid_.nx, grid_.ny);
}

// Posterior, registration, and the resulting contrast.
void ContourTracker::place(const RgbView& image) {
  see(image, near_cells());
  const unsigned char* const hidden = seen_.empty() ? nullptr : hidden_.data();
  choose_pixels(grid_, posterior_, options_.band, hidden, &registration_);
  const GridWarp before = grid_.warp;
  register_grid(options_, &registration_, &grid_);
  // A contour that nothing holds may shrink to nothing or blow up: then its warp is kept.
  const double grown = grid_.warp.scale() / before.scale();
  if (!(grown > 1 / kMaxGrowth && grown < kMaxGrowth)) grid_.warp = before;
  choose_samples(grid_, options_.band, hidden, &samples_);
  report_.contrast = contrast_at(samples_, grid_.warp, posterior_);
}

void ContourTracker::judge(const RgbView& image) {
  std::size_t both = 0, either = 0;
  for (std::size_t i = 0; i < before_.size(); ++i) {
    const bool a = before_[i] < 0, b = grid_.phi[i] < 0;
    both += a && b, either += a || b;
  }
  report_.overlap = either > 0 ? double(both) / double(either) : 0;
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
  if (report_.confidence >= kSure && inside_ >= kMinPixels) {
    report_.status = ContourStatus::kOk, report_.reason = ContourReason::kNone;
    lost_frames_ = 0;
    look_beside(image);
  } else if (report_.confidence >= (was_lost ? kSure : kDoubtful) && inside_ >= kMinPixels) {
    report_.status = ContourStatus::kWeak;
    report_.reason = contrast < report_.likeness ? ContourReason::kSidesAlike : ContourReason::kOtherColors;
  } else {
    report_.status = ContourStatus::kLost;
    report_.reason = ContourReason::kNoMatch;
    ++lost_frames_;
  }
}

// Tests an outline that is sure by its colours: where nothing held it, it may have run into its surroundings,
// and colours learnt there stay.
void ContourTracker::look_beside(const RgbView& image) {
  if (!options_.evidence || inside_ == 0) return;
  report_.shared = std::max(shared_outline(image, grid_, &shared_colors_), kSharedFades * report_.shared);
}

ContourFrame ContourTracker::finish(ShapeJudgement judgement, const unsigned char* recovered) {
  if (report_.status == ContourStatus::kLost) return frame();
  const auto inside = [](unsigned char cell) { return cell != 0; };
  if (recovered && std::any_of(recovered, recovered + grid_.phi.size(), inside)) replace_shape(recovered);
  const bool sure = report_.status == ContourStatus::kOk;
  const bool learn = judgement == ShapeJudgement::kNone || judgement == ShapeJudgement::kUnoccluded;
  // The whole shape, visible or remembered; half a shape is no template for the search after a loss.
  if (sure && (learn || !seen_.empty()))
    good_phi_ = grid_.phi, good_warp_ = grid_.warp, good_inside_ = grid_.inside;
  recentre();
  if (learn && sure && counted_) model_.pool(double(options_.object_rate), double(options_.background_rate));
  return frame();
}

// Moves the grid so that the shape's box is in its middle, with as many cells inside as at the start.
void ContourTracker::recentre() {
  ContourGrid& g = grid_;
  int x0 = g.nx, y0 = g.ny, x1 = 0, y1 = 0, inside = 0;
  for (int y = g.inside.y0; y <= g.inside.y1; ++y)
    for (int x = g.inside.x0; x <= g.inside.x1; ++x)
      if (g.phi[y * g.nx + x] < 0)
        x0 = std::min(x0, x), y0 = std::min(y0, y), x1 = std::max(x1, x), y1 = std::max(y1, y), ++inside;
  if (inside < kMinPixels) return;
  const double cx = 0.5 * (x0 + x1) - g.mid_x(), cy = 0.5 * (y0 + y1) - g.mid_y();
  double k = first_area_ > 0 ? std::sqrt(inside / first_area_) : 1;
  // Limited so that the background around the shape stays on the grid.
  k = std::max(
      k, std::max((x1 - x0 + 2 * kMinRing_px) / double(g.nx), (y1 - y0 + 2 * kMinRing_px) / double(g.ny)));
  if (std::max(std::abs(cx), std::abs(cy)) < kDriftCells && std::abs(std::log(k)) < kDriftLogScale) return;
  for (std::vector<float>* const values : {&g.phi, &seen_}) {
    if (values->empty()) continue;
    const FlatView from{values->data(), g.nx, g.ny};
    resampled_.resize(g.phi.size());
    for (int y = 0; y < g.ny; ++y)
      for (int x = 0; x < g.nx; ++x) {
        float phi, unused_x, unused_y;
        sample_flat(from, float(k * (x - g.mid_x()) + cx + g.mid_x()),
                    float(k * (y - g.mid_y()) + cy + g.mid_y()), &phi, &unused_x, &unused_y);
        resampled_[y * g.nx + x] = phi / float(k);
      }
    std::swap(*values, resampled_);
  }
  g.warp.t[0] += g.warp.a[0] * cx + g.warp.a[1] * cy, g.warp.t[1] += g.warp.a[2] * cx + g.warp.a[3] * cy;
  for (double& a : g.warp.a) a *= k;
  redistance(reach_cells(), &evolution_.distance, &g);
}

// Searches for a lost object with its last sure shape, first around its last place, then farther.
bool ContourTracker::look_around(const RgbView& image) {
  constexpr double kScales[] = {0.8, 1.25};
  constexpr int kStep_px = 8, kMaxReach_px = 240;
  grid_.phi = good_phi_, grid_.inside = good_inside_, grid_.warp = good_warp_;
  seen_.clear();
  const double half = 0.5 * good_warp_.scale() * std::max(grid_.nx, grid_.ny);
  const int reach = std::min(kMaxReach_px, to_int(half * (0.5 + 0.1 * lost_frames_)));
  ImagePart part = rect_of(grid_, grid_.all(), image);
  part = {std::max(0, part.x0 - reach), std::max(0, part.y0 - reach), std::min(image.width, part.x1 + reach),
          std::min(image.height, part.y1 + reach)};
  ++lost_frames_;
  model_.posterior_anywhere(image, part, &posterior_);
  choose_samples(grid_, options_.band, nullptr, &samples_);
  GridWarp best = good_warp_;
  double most = search_place(samples_, posterior_, reach, kStep_px, &best);
  for (const double scale : kScales) {
    GridWarp trial = best;
    for (double& a : trial.a) a *= scale;
    const double contrast = search_place(samples_, posterior_, 2 * kStep_px, kStep_px, &trial);
    if (contrast > most) most = contrast, best = trial;
  }
  bool found = most >= kFound * first_contrast_;
  if (!found && lost_frames_ > kPatience) {
    best = good_warp_;
    most = find_anywhere(image, model_, samples_, &redetection_, &best);
    found = most >= kFoundFar * first_contrast_;
  }
  report_.contrast = most, report_.confidence = 0;
  if (!found) return false;
  grid_.warp = best;
  return true;
}

// Replaces the shape that was found.
void ContourTracker::replace_shape(const unsigned char* inside) {
  seen_ = grid_.phi;
  for (std::size_t cell = 0; cell < grid_.phi.size(); ++cell) grid_.phi[cell] = inside[cell] ? -0.5f : 0.5f;
  redistance(reach_cells(), &evolution_.distance, &grid_);
  inside_ = 0;
  for (const float p : grid_.phi) inside_ += p < 0;
}

std::span<const float> ContourTracker::posterior_on_grid(const RgbView& image) {
  model_.posterior(image, grid_, grid_.all(), &posterior_, true);
  find_band(grid_, std::numeric_limits<float>::max(), &evolution_.band);
  evolution_.foreground.assign(grid_.phi.size(), 0.5f);
  sample_posterior(grid_, posterior_, &evolution_);
  return evolution_.foreground;
}

ContourShape ContourTracker::shape_now() const { return {grid_.nx, grid_.ny, grid_.phi, grid_.to_image()}; }

ContourFrame ContourTracker::frame() {
  draw_mask();
  return {report_, shape_now(), width_, height_, mask_};
}

// 0 beyond the grid.
void ContourTracker::draw_mask() {
  mask_.assign(std::size_t(width_) * height_, 0);
  if (report_.status == ContourStatus::kLost) return;  // a lost object has an empty mask
  const RgbView image{nullptr, width_, height_};       // only its size matters
  const FlatView view{grid_.phi.data(), grid_.nx, grid_.ny};
  const CellBox cells = grid_.inside.grown(1, grid_.nx, grid_.ny);
  each_row_on(grid_, cells, rect_of(grid_, cells, image),
              [&](int y, int xa, int xb, double gx, double gy, double dx, double dy) {
                unsigned char* const to = mask_.data() + std::ptrdiff_t(y) * width_;
                for (int x = xa; x < xb; ++x, gx += dx, gy += dy) {
                  float phi, unused_x, unused_y;
                  sample_flat(view, float(gx), float(gy), &phi, &unused_x, &unused_y);
                  to[x] = phi < 0;
                }
              });
}

}  // namespace sdftrack::contour
