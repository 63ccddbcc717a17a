// SPDX-License-Identifier: MIT
#include "contour/memory/occlusion_handler.h"

#include <algorithm>
#include <cmath>
#include <span>
#include <stdexcept>
#include <utility>

#include "contour/memory/mask_ops.h"
#include "contour/memory/resampling.h"

namespace sdftrack::contour {

namespace {

constexpr double kMinLoss = 0.05;  // share of the area that must be missing for an occlusion to be considered
constexpr double kLossErrors = 5;  // the same in units of the rms error of the predicted size
constexpr std::size_t kLearntAfter = 10;  // frames: a silhouette that is about to be covered is not learnt
// In a 64 x 64 frame: pixels of the object's colours this near to the expected silhouette belong to it.
constexpr float kNear_px = 2.5f;
// Distances beyond the expected silhouette at which pixels of the object's colours are counted.
constexpr float kOff_px[] = {1.5f, 8};
constexpr double kSmoothed_px = 1;   // of the posterior, before it is thresholded at one half
constexpr float kMinKnown = 0.2f;    // mean |2 p - 1| around a pixel; less: colours of neither side
constexpr int kMinSeen = 12;         // pixels of the frame; fewer give no information
constexpr double kMinPiece = 0.25;   // of the largest hidden piece: smaller ones are limbs in another pose
constexpr double kMinWeight = 0.02;  // of a frame with nearly everything hidden, in the motion

// The visible part of a found silhouette, in its frame; sets the number of pixels with its colours beyond it.
Mask seen_part(const Mask& mask, const Picture& signed_odds, const GridWarp& warp, int size, Found* found) {
  const auto in_frame = [&](const Picture& picture) {
    return seen_from(picture, warp, found->placement, size);
  };
  const double sigma_px = kSmoothed_px * size / kFrame;
  const Picture colors = blurred(in_frame(signed_odds), sigma_px, Border::kMirrored);
  const Picture known = blurred(in_frame(each<float>(signed_odds, [](float e) { return std::abs(e); })),
                                sigma_px, Border::kMirrored);
  const Mask outlined = seen_from(mask, warp, found->placement, size);
  const Picture& phi = found->expected.phi;
  const float per_px = float(kFrame) / float(size);
  Mask seen(size, size);
  int beyond = 0;
  for (std::size_t i = 0; i < seen.size(); ++i) {
    if (!(colors.values[i] > 0 || (outlined.values[i] && known.values[i] > kMinKnown))) continue;
    const float distance = phi.values[i] * per_px;
    beyond += distance > kOff_px[0] && distance < kOff_px[1];
    seen.values[i] = distance < kNear_px;
  }
  found->expected.beyond_px = beyond;
  return seen;
}

Mask mask_of(const ContourGrid& grid) {
  Mask out(grid.nx, grid.ny);
  std::transform(grid.phi.begin(), grid.phi.end(), out.values.begin(), [](float phi) { return phi < 0; });
  return out;
}

GridWarp from_corner(const ContourGrid& grid) {
  const std::array<double, 9> m = grid.to_image();
  return {{m[0], m[1], m[3], m[4]}, {m[2], m[5]}};
}

}  // namespace

OcclusionHandler::Shape::Shape(const ContourGrid& grid)
    : mask(mask_of(grid)), warp(from_corner(grid)), placement(placement_of(mask, warp)) {}

void OcclusionHandler::begin(const ContourTracker& tracker, const SilhouetteMemory& memory) {
  *this = OcclusionHandler();
  whole(Shape(tracker.grid()), memory.library().size());
}

// Adds a fully visible shape to the motion; returns it in the memory's frame.
Mask OcclusionHandler::whole(const Shape& shape, int size) {
  motion_.add(time_, shape.placement);
  size_px_ = shape.placement.size_px;
  last_ = seen_from(shape.mask, shape.warp, shape.placement, size);
  return last_;
}

OcclusionHandler::Judged OcclusionHandler::judge(ContourTracker* tracker, const RgbView& image, bool burn_in,
                                                 SilhouetteMemory* memory) {
  const int size = memory->library().size();
  if (last_.width != size) throw std::invalid_argument("memory: expected the one that this track began with");
  const ContourStatus status = tracker->report().status;
  const bool sure = status == ContourStatus::kOk;
  if (status == ContourStatus::kLost) {
    ++time_;
    lost_ = true;
    waiting_.clear();
    return {};
  }
  if (burn_in && !sure) return {};
  ++time_;
  const Shape shape(tracker->grid());
  if (burn_in) {
    lost_ = false;
    memory->learn(whole(shape, size));
    return {};
  }
  const Prediction predicted = predict(shape);
  const double ratio = shape.placement.size_px / predicted.size_px;
  if (sure && 1 - ratio * ratio <= std::max(kMinLoss, kLossErrors * predicted.size_error)) {
    learn_later(whole(shape, size), memory);
    return {ShapeJudgement::kUnoccluded, {}};
  }
  waiting_.clear();
  Picture posterior(shape.mask.width, shape.mask.height);
  const std::span<const float> cells = tracker->posterior_on_grid(image);
  posterior.values.assign(cells.begin(), cells.end());
  return judge_loss(shape, predicted, posterior, *memory);
}

// After a loss the motion starts again, but the size is kept.
Prediction OcclusionHandler::predict(const Shape& shape) {
  if (lost_) {
    motion_.forget();
    motion_.add(time_, {shape.placement.center_px, size_px_, shape.placement.turn}, 0.5);
    lost_ = false;
  }
  return motion_.predict(time_);
}

void OcclusionHandler::learn_later(Mask mask, SilhouetteMemory* memory) {
  waiting_.push_back(std::move(mask));
  if (waiting_.size() <= kLearntAfter) return;
  memory->learn(waiting_.front());
  waiting_.erase(waiting_.begin());
}

OcclusionHandler::Judged OcclusionHandler::judge_loss(const Shape& shape, const Prediction& predicted,
                                                      const Picture& posterior,
                                                      const SilhouetteMemory& memory) {
  const SilhouetteLibrary& library = memory.library();
  if (library.count() == 0) return novel(shape, predicted);
  const Picture signed_odds = each<float>(posterior, [](float p) { return 2 * p - 1; });
  Found found = find_silhouette(signed_odds, shape.warp, predicted, shape.placement.turn, library,
                                library.dissimilarity(last_));
  const Mask seen = seen_part(shape.mask, signed_odds, shape.warp, library.size(), &found);
  if (area_of(seen) < kMinSeen) return novel(shape, predicted);
  const Explanation explained = library.explain_by(seen, found.expected, true);
  switch (memory.judge(seen, explained, kMinPiece)) {
    case Judgement::kNovel:
      return novel(shape, predicted);
    case Judgement::kUnoccluded:
      whole(shape, library.size());
      return {ShapeJudgement::kUnoccluded, {}};
    case Judgement::kOccluded:
      break;
  }
  const double visible = 1 - explained.missing;
  motion_.add(time_, found.placement, std::max(kMinWeight, visible * visible));
  last_ = inside_of(found.expected.phi);
  return {ShapeJudgement::kOccluded,
          put_back(explained.completed, shape.warp, found.placement, shape.mask.width, shape.mask.height)};
}

OcclusionHandler::Judged OcclusionHandler::novel(const Shape& shape, const Prediction& predicted) {
  motion_.add(time_, {predicted.center_px, predicted.size_px, shape.placement.turn}, kMinWeight);
  return {ShapeJudgement::kNovel, {}};
}

}  // namespace sdftrack::contour
