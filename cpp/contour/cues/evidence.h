// SPDX-License-Identifier: MIT
// Confidence of an outline from evidence that its energy does not contain: the optical flow and the colours
// at the start (docs/math/contour.md, section 8).
#pragma once

#include <array>
#include <string>
#include <vector>

#include "contour/memory/plane.h"
#include "contour/motion_odds.h"
#include "contour/results.h"

namespace sdftrack::contour {

// What an outline is judged by.
struct Evidence {
  double disagreement = 0;       // 1 less the IoU of the mask and the last mask moved by the optical flow
  double mean_disagreement = 0;  // the same, averaged over the last frames
  double strangeness = 0;  // 1 less the affinity (sum of sqrt(p q)) of the colours inside and at the start
  double first_instability = 0;  // of a first mask from a box (box_start.h); 0 for a start from a mask
  double shared = 0;             // of the outline, beside which the colours are the object's (ContourReport)
};

// Logistic regression of "IoU >= 0.5": `python -m experiments run contour_confidence --fit` prints these.
constexpr double kEvidenceBias = 4.23;
constexpr std::array<double, 4> kEvidenceWeights = {-2.21, -8.91, -4.23, -5.67};  // but for `shared`
constexpr double kSure = 0.9;                                                     // ok from here on
constexpr double kMaxShared = 0.55;                                               // chosen on the same videos
constexpr double kMaxInstability = 0.2;  // of a first mask: what is followed from there may be anything

// Estimated chance that the outline's IoU with the truth is one half or more.
double certainty(const Evidence& evidence);

struct EvidenceVerdict {
  ContourStatus status;
  std::string reason;
  double confidence;
};
// What the colours call lost or weak stays so.
EvidenceVerdict verdict(const Evidence& evidence, ContourStatus status, const std::string& reason);

// Compares each frame's mask, a byte per pixel, with the first one, and with the last moved by the flow.
class EvidenceGatherer {
 public:
  EvidenceGatherer() = default;
  EvidenceGatherer(const RgbView& image, const unsigned char* mask, double first_instability);

  // The flow from this image to the last one, nullptr: none.
  Evidence gather(const RgbView& image, const unsigned char* mask, const FlowView* flow, double shared);
  // A frame without an outline.
  void skip(const unsigned char* mask) { keep(mask); }
  int width() const { return mask_.width; }
  int height() const { return mask_.height; }

  template <class Archive, class Self>
  static void visit(Archive& archive, Self& self) {
    auto& [mask, first, first_instability, mean] = self;
    archive(mask, first, first_instability, mean);
  }

 private:
  void keep(const unsigned char* mask);

  Mask mask_;
  std::vector<double> first_;  // colours at the start
  double first_instability_ = 0, mean_ = 0;
};

// Shares of the colours inside, in bins of 32 levels per channel; 0 where there is nothing inside.
std::vector<double> colors_inside(const RgbView& image, const unsigned char* mask);
// The last mask where the flow takes it; pixels beside the flow's part stay.
Mask moved_mask(const Mask& mask, const FlowView& flow);

}  // namespace sdftrack::contour
