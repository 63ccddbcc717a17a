// SPDX-License-Identifier: MIT
// Complete pose searches on the GPU, of one object or of all at once: the host waits only for the result. No
// CUDA header is needed to include this; only builds with SDFTRACK_CUDA define it.
#pragma once

#include <vector>

#include "energies/beside.h"
#include "energies/cuda_work.h"

namespace sdftrack::energies {

// The search of one object. It is copied to the device unchanged.
template <class Field, class Penalty>
struct PoseProblem {
  Term<Field, Penalty> term;         // pixels and volume on the device, where the pose is filled in
  const int* pixel_count = nullptr;  // on the device: number of pixels; nullptr: that of the term
  int settle_steps = 0;              // of the rays before the first evaluation
  optim::LmRules rules{};
  Beside beside{};
};

template <int P>
struct PoseFit {
  optim::PoseSearch<P> search;  // at: its start, and after the search its end
  int hits = 0;                 // rays that met the model when they were classified
  int pixels = 0;
  unsigned arrived = 0;  // working memory
};

// For the pairs of compiled.inc that have one object and no intrinsics.
template <class Field, class Penalty>
struct CudaPoseFits {
  using Problem = PoseProblem<Field, Penalty>;
  using Fit = PoseFit<Field::P>;
  // Runs each problem from its fit's pose, `rounds` times in all, each round from the last one's end and with
  // the rays settled and classified again. steps: of the last round; those of problem k start at k * room,
  // where room is the largest number of steps that the rules of a problem allow. Returns room. back: the
  // uploaded pixels, whose hits and classes are brought back too; nullptr: they stay on the device.
  static int run(CudaWork* work, std::vector<Problem>* problems, std::vector<Fit>* fits,
                 std::vector<optim::LmStep>* steps, int rounds = 1, PixelSet* back = nullptr);
};

}  // namespace sdftrack::energies
