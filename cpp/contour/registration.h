// SPDX-License-Identifier: MIT
// The pose of the object's grid in an image of posteriors: Gauss-Newton on a similarity or an affinity.
#pragma once

#include <vector>

#include "contour/contour_ops.h"
#include "contour/options.h"
#include "contour/region_model.h"
#include "optim/lm.h"

namespace sdftrack::contour {

struct RegistrationWork {
  std::vector<float> u, v, foreground;  // the pixels of the sum
  optim::LmRecord record;
};

// Lists the pixels within `band` cells of the current contour, without those on cells that are known to be
// hidden (nullptr: no such cells).
void choose_pixels(const ContourGrid& grid, const PosteriorImage& posterior, float band,
                   const unsigned char* hidden, RegistrationWork* work);

// -sum log f over the listed pixels with its gradient and Gauss-Newton Hessian; P: 4 or 6.
template <int P>
energies::Sums<double, P> registration_sums(const ContourGrid& grid, const RegistrationWork& work,
                                            double softness);

// Moves grid->warp; the shape stays.
void register_grid(const ContourOptions& options, RegistrationWork* work, ContourGrid* grid);

}  // namespace sdftrack::contour
