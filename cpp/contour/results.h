// SPDX-License-Identifier: MIT
// The results of each phase of the contour tracker. The arrays belong to the tracker: they are valid until
// its next call, and nothing is allocated for them.
#pragma once

#include <array>
#include <span>

namespace sdftrack::contour {

enum class ContourStatus { kOk, kWeak, kLost };

// Why an outline is doubtful.
enum class ContourReason { kNone, kSidesAlike, kOtherColors, kNoMatch };
const char* sentence(ContourReason reason);

// How well a frame's outline is supported by the colours.
struct ContourReport {
  ContourStatus status = ContourStatus::kOk;
  double confidence = 1;  // 0 .. 1
  ContourReason reason = ContourReason::kNone;
  // The inputs of the confidence: mean posterior inside minus just outside; likeness of the colours inside to
  // those at the start; overlap of the outlines before and after this frame; mean log f in the band.
  double contrast = 1, likeness = 1, overlap = 1, mean_log = 0;
  // Share of the outline that has the object's colours next to it; the largest recent value.
  double shared = 0;

  template <class Archive, class Self>
  static void visit(Archive& archive, Self& self) {
    auto& [status, chance, why, sides, alike, same, mean, share] = self;
    archive.choice(status, ContourStatus::kLost), archive.choice(why, ContourReason::kNoMatch);
    archive(chance, sides, alike, same, mean, share);
  }
};

// A shape memory's judgement of a frame's shape. The tracker learns only from unoccluded shapes; without a
// memory, or while the memory itself learns, it learns from every sure one.
enum class ShapeJudgement { kNone, kUnoccluded, kOccluded, kNovel };

// The grid and its place in the image.
struct ContourShape {
  int nx = 0, ny = 0;
  std::span<const float> phi;       // cells, negative inside, row by row
  std::array<double, 9> warp = {};  // 3 x 3: cell (column, row, 1) to pixel (x, y, 1)
};

// Phase 1, `observe`: the place and shape of the object in an image. Nothing is learned yet.
struct ContourObservation {
  ContourReport report;
  ContourShape shape;
};

// Phase 2, `finish`: the result after judgement, correction of drift and learning of colours.
struct ContourFrame {
  ContourReport report;
  ContourShape shape;
  int width = 0, height = 0;
  std::span<const unsigned char> mask;  // one byte per pixel, 0 or 1; 0 everywhere when lost
};

}  // namespace sdftrack::contour
