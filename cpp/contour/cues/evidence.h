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

// The observations from which an outline's confidence is computed.
struct Evidence {
  double disagreement = 0;       // 1 minus the IoU of the mask and the last mask moved by the optical flow
  double mean_disagreement = 0;  // disagreement, averaged over the last frames
  double strangeness = 0;  // 1 minus the affinity (sum of sqrt(p q)) of the colours inside and at the start
  double first_instability = 0;  // of a first mask from a box (box_start.h); 0 for a start from a mask
  double shared = 0;             // share of the outline with the object's colours next to it (ContourReport)
};

// Logistic regression of "IoU >= 0.5": `python -m experiments run contour_confidence --fit` prints these.
constexpr double kEvidenceBias = 4.23;
constexpr std::array<double, 4> kEvidenceWeights = {-2.21, -8.91, -4.23, -5.67};  // without `shared`
constexpr double kSure = 0.9;                                                     // status ok from here on
constexpr double kMaxShared = 0.55;                                               // chosen on the same videos
constexpr double kMaxInstability = 0.2;  // of a first mask; above it the tracked region may be anything

// Estimated chance that the outline's IoU with the truth is one half or more.
double certainty(const Evidence& evidence);

struct EvidenceVerdict {
  ContourStatus status;
  std::string reason;
  double confidence;
};
// A status of lost or weak from the colours is kept.
EvidenceVerdict verdict(const Evidence& evidence, ContourStatus status, const std::string& reason);

// Compares each frame's mask, a byte per pixel, with the first mask and with the last mask moved by the flow.
class EvidenceGatherer {
 public:
  EvidenceGatherer() = default;
  EvidenceGatherer(const RgbView& image, const unsigned char* mask, double first_instability);

  // flow: from this image to the last one; nullptr: no flow.
  Evidence gather(const RgbView& image, const unsigned char* mask, const FlowView* flow, double shared);
  // For a frame without an outline.
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

// Shares of the colours inside, in bins of 32 levels per channel; all 0 for an empty mask.
std::vector<double> colors_inside(const RgbView& image, const unsigned char* mask);
// The last mask moved by the flow; pixels outside the flow's part stay.
Mask moved_mask(const Mask& mask, const FlowView& flow);

}  // namespace sdftrack::contour
