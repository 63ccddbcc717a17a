// SPDX-License-Identifier: MIT
#include "contour/memory/silhouette_memory.h"

#include <cmath>
#include <numbers>
#include <stdexcept>

#include "contour/memory/mask_ops.h"
#include "contour/memory/occluders.h"

namespace sdftrack::contour {

namespace {

constexpr int kFirst = 5;  // silhouettes, from which on the next one's error calibrates the threshold
constexpr double kMinKnownDetails =
    0.5;                             // of the details; less is novel (Table 6.3: more than half of the units)
constexpr double kMinOutline = 0.2;  // of the expected outline; with less visible, all details are hidden
constexpr double kMaxOff_px = 2;     // excess per contour pixel of a 64 x 64 grid
constexpr double kMaxDoubt = 2;  // of the part to be added; above it the visible part may be nearer the truth
constexpr double kMaxRiddled = 0.15;  // of the inside, neither visible nor in one hidden piece: leaves, slats
constexpr double kMinError = 0.02;    // hidden share up to which a difference is one of two outlines

}  // namespace

SilhouetteMemory::SilhouetteMemory(const Options& options) : options_(options), library_(options.library) {}

double SilhouetteMemory::threshold() const {
  const double rms = calibrated_ > 0 ? std::sqrt(squares_ / calibrated_) : 0;
  return std::numbers::sqrt2 * std::max(kMinError, rms);
}

void SilhouetteMemory::learn(const Mask& mask) {
  if (library_.count() >= kFirst && calibrated_ < options_.calibrate_on) {
    const Explanation explained = library_.explain(mask);  // before it is stored: the error on a new one
    if (!is_novel(mask, explained, 0)) {
      ++calibrated_;
      squares_ += explained.missing * explained.missing;
    }
  }
  library_.add(mask);
  ++learnt_;
}

SilhouetteAssessment SilhouetteMemory::assess(const Mask& mask) const {
  if (library_.count() == 0) throw std::logic_error("memory: nothing has been learned");
  SilhouetteAssessment out;
  out.explanation = library_.explain(mask);
  const Explanation& explained = out.explanation;
  out.judgement = judge(mask, explained);
  out.accepted = out.judgement == Judgement::kOccluded && explained.doubt() <= kMaxDoubt;
  out.threshold = threshold();
  out.coefficients = library_.series().coefficients(explained.completed);
  out.std.assign(out.coefficients.size(), 0);
  if (explained.missing == 0) return out;
  for (std::size_t c = 0; c < out.std.size(); ++c) {
    const auto code = [&](std::size_t k) { return double(library_.code(explained.finalists[k])[c]); };
    double mean = 0, variance = 0;
    for (std::size_t k = 0; k < explained.weights.size(); ++k) mean += double(explained.weights[k]) * code(k);
    for (std::size_t k = 0; k < explained.weights.size(); ++k)
      variance += double(explained.weights[k]) * (code(k) - mean) * (code(k) - mean);
    out.std[c] = std::sqrt(variance);
  }
  return out;
}

// Slivers of another pose raise the error, but a silhouette is not occluded if there is nothing to recover.
Judgement SilhouetteMemory::judge(const Mask& mask, const Explanation& explained, double min_piece) const {
  if (is_novel(mask, explained, min_piece)) return Judgement::kNovel;
  const bool occluded = explained.missing >= threshold() && area_of(explained.hidden) > 0;
  return occluded ? Judgement::kOccluded : Judgement::kUnoccluded;
}

// Too little of the visible part is known, too little is visible, or there are too many occluders.
bool SilhouetteMemory::is_novel(const Mask& mask, const Explanation& explained, double min_piece) const {
  return explained.explained < kMinKnownDetails || explained.outline < kMinOutline ||
         explained.riddled > kMaxRiddled || explained.off_px > kMaxOff_px * options_.library.size / kFrame ||
         count_occluders(explained.hidden, mask, min_piece) > options_.max_occluders;
}

void SilhouetteMemory::restore(const State& state) {
  library_.restore(state.library);
  learnt_ = state.learnt, calibrated_ = state.calibrated, squares_ = state.squares;
}

}  // namespace sdftrack::contour
