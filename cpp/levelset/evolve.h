// SPDX-License-Identifier: MIT
// The thesis' evolution of a level set by the evidence on inside and outside (4.5.2).
#pragma once

#include <vector>

#include "sdf/grid.h"

namespace sdftrack::levelset {

// Lengths in voxels.
struct EvolveOptions {
  float sigma_h = 4;     // of the Heaviside (4.38)
  float sigma_phi = 3;   // of the prior on |grad phi| (4.39)
  float dt = 1;          // of a step
  bool printed = false;  // the potential of 4.39 in place of the double well of Li, Xu, Gui and Fox (2010)
};

// Steps up to this length never increase the energy; longer ones may diverge.
float longest_step(const EvolveOptions& options);

// phi_m after `steps` steps; log_ratio: inside to outside, by voxel, including the prior. Throws
// std::invalid_argument if an option is not positive or a step is too long.
std::vector<float> evolve(const sdf::Grid& grid, const float* phi_m, const float* log_ratio, int steps,
                          const EvolveOptions& options, int threads);

// As evolve(), on a CUDA device.
std::vector<float> evolve_cuda(const sdf::Grid& grid, const float* phi_m, const float* log_ratio, int steps,
                               const EvolveOptions& options, int device);

// Throws std::invalid_argument for options that both functions reject.
void check_evolution(const EvolveOptions& options, int steps);

}  // namespace sdftrack::levelset
