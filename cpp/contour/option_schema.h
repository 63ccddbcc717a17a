// SPDX-License-Identifier: MIT
// The options of the contour tracker, one line each: a new one is a member of ContourOptions and a line here.
#pragma once

#include "base/option_schema.h"
#include "contour/options.h"

namespace sdftrack::contour {

inline constexpr Choice<bool> kWarps[] = {{false, "similarity"}, {true, "affine"}};
inline constexpr Choice<OpinionPool> kPools[] = {{OpinionPool::kLinear, "linear"},
                                                 {OpinionPool::kLogarithmic, "log"}};
inline constexpr Choice<bool> kMotions[] = {{false, "none"}, {true, "flow"}};
inline constexpr Choice<bool> kBoxStarts[] = {{false, "colors"}, {true, "place"}};
inline constexpr Choice<bool> kConfidences[] = {{false, "colors"}, {true, "evidence"}};

// clang-format off
template <OptionsOf<ContourOptions> Options, class Visit>
void visit_options(Options& o, Visit& f) {
  f("warp", o.affine, Choices<bool>(kWarps), "", "motion model of the grid: similarity (4 parameters) or affine (6)");
  f("pool", o.pool, Choices<OpinionPool>(kPools), "", "opinion pool that updates the colour histograms with each frame: linear or log (logarithmic)");
  f("bins", o.bins, either(16, 32), "", "histogram bins per colour channel, 16 or 32");
  f("windows", o.windows, from_to(1, 16), "", "number of local histograms along each side of the grid; 1: one pair of global histograms, as printed");
  f("shrink", o.shrink, from_to(1, 1e6), "px", "weight of the global histograms in each local one, as a number of pixels");
  f("object_rate", o.object_rate, from_to(0, 1), "", "learning rate of the object's histograms: weight of a new frame");
  f("background_rate", o.background_rate, from_to(0, 1), "", "learning rate of the background's histograms: weight of a new frame");
  f("motion", o.motion, Choices<bool>(kMotions), "", "second cue of the posterior beside the colours: none, or flow (whether a pixel moves as the object does)");
  f("confidence", o.evidence, Choices<bool>(kConfidences), "", "confidence and status: from the colours alone, as in the thesis, or from evidence that was not minimised (optical flow, colours at the start)");
  f("max_cells", o.max_cells, from_to(32, 2048), "", "maximum number of grid cells along the object's longer side; bounds the time per frame");
  f("softness", o.softness, from_to(0.3, 10), "cells", "width of the smoothed Heaviside step across the contour");
  f("band", o.band, from_to(2, 32), "cells", "half width of the narrow band around the contour that is evaluated");
  f("registration_steps", o.registration_steps, from_to(0, 200), "", "maximum number of Gauss-Newton iterations per frame");
  f("reach", o.reach, from_to(0, 200), "px", "search radius for motion between two frames that is too large for Gauss-Newton; 0: no search");
  f("dt", o.dt, from_to(1e-3, 10), "", "step size of the level-set evolution");
  f("mu", o.mu, from_to(0, 10), "", "weight of the distance regulariser; mu dt <= 0.2");
  f("tension", o.tension, from_to(0, 4), "", "contour tension; 0: the regulariser as printed, 1: a Laplacian");
  f("box_start", o.box_prior, Choices<bool>(kBoxStarts), "", "first segmentation of a box: by its colors alone, or also by the place in the box and the edges of the image");
}
// clang-format on

}  // namespace sdftrack::contour
