// SPDX-License-Identifier: MIT
// A memory of an object's silhouettes: detects occlusion and recovers occluded parts (thesis, chapter 6;
// docs/shape_memory.md). Masks lie in a frame that moves with the object, on a grid of a fixed size.
#pragma once

#include <vector>

#include "contour/memory/silhouette_library.h"

namespace sdftrack::contour {

enum class Judgement { kUnoccluded, kOccluded, kNovel };

struct SilhouetteAssessment {
  Judgement judgement = Judgement::kNovel;
  bool accepted = false;  // the hidden part is to be added: the silhouette is occluded without doubt
  Explanation explanation;
  double threshold = 0;
  std::vector<double> coefficients, std;  // harmonics of the completed silhouette
};

class SilhouetteMemory {
 public:
  struct Options {
    SilhouetteLibrary::Options library;
    int max_occluders = 2;   // a silhouette with more is novel
    int calibrate_on = 100;  // known silhouettes whose error sets the threshold
  };
  explicit SilhouetteMemory(const Options& options);

  const SilhouetteLibrary& library() const { return library_; }
  int learnt() const { return learnt_; }
  // Missing share from which a silhouette counts as occluded: sqrt(2) times the training error.
  double threshold() const;

  // A silhouette that is known to be unoccluded.
  void learn(const Mask& mask);
  // At least one silhouette must have been learnt.
  SilhouetteAssessment assess(const Mask& mask) const;
  // Judges an explained silhouette. Hidden pieces below `min_piece` times the largest are not occluders.
  Judgement judge(const Mask& mask, const Explanation& explained, double min_piece = 0) const;

  // All but the options.
  struct State {
    int learnt = 0, calibrated = 0;
    double squares = 0;
    SilhouetteLibrary::State library;
  };
  State state() const { return {learnt_, calibrated_, squares_, library_.state()}; }
  void restore(const State& state);

 private:
  bool is_novel(const Mask& mask, const Explanation& explained, double min_piece) const;

  Options options_;
  SilhouetteLibrary library_;
  int learnt_ = 0;
  int calibrated_ = 0;  // silhouettes from which the threshold is computed
  double squares_ = 0;  // sum of their squared missing shares
};

}  // namespace sdftrack::contour
