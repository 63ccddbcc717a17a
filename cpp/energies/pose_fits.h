// SPDX-License-Identifier: MIT
// Whole searches for poses on the GPU: of each object, and of all at once, the host waits for the result
// alone. No CUDA header is needed to include this; only builds with SDFTRACK_CUDA define it.
#pragma once

#include <vector>

#include "energies/beside.h"
#include "energies/cuda_work.h"

namespace sdftrack::energies {

// One object. It goes to the device as it is.
template <class Field, class Penalty>
struct PoseProblem {
  Term<Field, Penalty> term;         // pixels and volume on the device; the pose is filled in there
  const int* pixel_count = nullptr;  // on the device: how many pixels there are; nullptr: as the term says
  int settle_steps = 0;              // of the rays before the first look
  optim::LmRules rules{};
  Beside beside{};
};

template <int P>
struct PoseFit {
  optim::PoseSearch<P> search;  // at: where it begins, and then where it has ended
  int hits = 0;                 // rays that met the model when they were told apart
  int pixels = 0;
  unsigned arrived = 0;  // working memory
};

// For the pairs of one object without intrinsics.
template <class Field, class Penalty>
struct CudaPoseFits {
  using Problem = PoseProblem<Field, Penalty>;
  using Fit = PoseFit<Field::P>;
  // Each problem from its fit's pose to the end, and from there `rounds` times in all, the rays settled and
  // told apart anew. steps: of the last round, those of problem k from k * room on, room being the most steps
  // that the rules of one allow; returns it. back: the uploaded pixels, whose hits and classes are brought
  // back too; nullptr: they are left there.
  static int run(CudaWork* work, std::vector<Problem>* problems, std::vector<Fit>* fits,
                 std::vector<optim::LmStep>* steps, int rounds = 1, PixelSet* back = nullptr);
};

}  // namespace sdftrack::energies
