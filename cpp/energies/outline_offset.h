// SPDX-License-Identifier: MIT
// Where along a line across the outline the colours change from the object's to the background's: the
// distribution of sparse region models (Stoiber et al., ACCV 2020; SRT3D, IJCV 2022).
#pragma once

namespace sdftrack::energies {

constexpr int kMaxReach = 16;    // steps to both sides
constexpr int kBeyondReach = 4;  // further samples on both sides, where the step function is flat
constexpr int kMaxSamples = 2 * (kMaxReach + kBeyondReach) + 1;

struct OutlineOffset {
  double mean, sd;  // steps from the middle sample, outwards
  double contrast;  // mean object probability inside minus outside: at best 1
};

// chance[i] of 2 (reach + kBeyondReach) + 1 samples, one per step from the inside outwards: the posterior
// that the sample's colour is the object's, not the background's, with equal priors. With the smoothed steps
// h_f, h_b = 1/2 -+ a tanh((r - d) / (2 s)) the offset d has the posterior
//   p(d) ~ prod_r (h_f(r - d) p_f(r) + h_b(r - d) p_b(r)), d = -reach..reach;
// mean and sd are its moments. The amplitude a sets how often a colour misleads, the slope s how sharp the
// outline is in the image.
OutlineOffset outline_offset(const float* chance, int reach);

}  // namespace sdftrack::energies
