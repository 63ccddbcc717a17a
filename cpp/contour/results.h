// SPDX-License-Identifier: MIT
// What each phase of the contour tracker returns. The arrays are the tracker's own: they hold until its next
// call, and nothing is allocated for them.
#pragma once

#include <array>
#include <span>

namespace sdftrack::contour {

enum class ContourStatus { kOk, kWeak, kLost };

// What speaks against an outline.
enum class ContourReason { kNone, kSidesAlike, kOtherColors, kNoMatch };
const char* sentence(ContourReason reason);

// How well a frame's outline is supported by the colours.
struct ContourReport {
  ContourStatus status = ContourStatus::kOk;
  double confidence = 1;  // 0 .. 1
  ContourReason reason = ContourReason::kNone;
  // What the confidence is made of: mean posterior inside less that beside the contour; how far the colours
  // inside are those at the start; how much of the outline before and after this frame is the same; mean
  // log f in the band.
  double contrast = 1, likeness = 1, overlap = 1, mean_log = 0;
  // Of the outline, the share beside which the colours are the object's; the largest lately.
  double shared = 0;

  template <class Archive, class Self>
  static void visit(Archive& archive, Self& self) {
    auto& [said, chance, why, sides, alike, same, mean, share] = self;
    archive.choice(said, ContourStatus::kLost), archive.choice(why, ContourReason::kNoMatch);
    archive(chance, sides, alike, same, mean, share);
  }
};

// What a memory of shapes says of a frame's shape. Only an unoccluded one is learned from; without a memory,
// or while the memory itself learns, every sure one is.
enum class ShapeJudgement { kNone, kUnoccluded, kOccluded, kNovel };

// The grid as it lies in the image.
struct ContourShape {
  int nx = 0, ny = 0;
  std::span<const float> phi;       // cells, negative inside, row by row
  std::array<double, 9> warp = {};  // 3 x 3: cell (column, row, 1) to pixel (x, y, 1)
};

// Phase 1, `observe`: where the object is in an image, and its shape. Nothing is learned yet.
struct ContourObservation {
  ContourReport report;
  ContourShape shape;
};

// Phase 2, `finish`: the frame's result, with the judgement applied, the drift corrected, the colours
// learned.
struct ContourFrame {
  ContourReport report;
  ContourShape shape;
  int width = 0, height = 0;
  std::span<const unsigned char> mask;  // one byte per pixel, 0 or 1; 0 everywhere when lost
};

}  // namespace sdftrack::contour
