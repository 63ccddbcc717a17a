// SPDX-License-Identifier: MIT
// The options of the contour tracker, one line each: a new one is a member of ContourOptions and a line here.
#pragma once

#include "base/option_schema.h"
#include "contour/options.h"

namespace sdftrack::contour {

inline constexpr Choice<bool> kWarps[] = {{false, "similarity"}, {true, "affine"}};
inline constexpr Choice<OpinionPool> kPools[] = {{OpinionPool::kLinear, "linear"},
                                                 {OpinionPool::kLogarithmic, "log"}};

// clang-format off
template <OptionsOf<ContourOptions> Options, class Visit>
void visit_options(Options& o, Visit& f) {
  f("warp", o.affine, Choices<bool>(kWarps), "", "similarity (4 unknowns) or affine (6): what moves the grid");
  f("pool", o.pool, Choices<OpinionPool>(kPools), "", "of a frame's colours into the histograms: linear or log (logarithmic)");
  f("bins", o.bins, either(16, 32), "", "of the histograms per channel, 16 or 32");
  f("windows", o.windows, from_to(1, 16), "", "histograms along each side of the grid; 1: one pair for the whole, as printed");
  f("shrink", o.shrink, from_to(1, 1e6), "px", "pixels that a window's histograms borrow from those of the whole");
  f("object_rate", o.object_rate, from_to(0, 1), "", "share of a frame in the object's histograms, once pooled");
  f("background_rate", o.background_rate, from_to(0, 1), "", "the same for the background's");
  f("least_posterior", o.min_posterior, from_to(1e-6, 0.4), "", "of a pixel, and of its opposite: no colour proves anything");
  f("ring", o.ring, from_to(0.05, 2), "", "width of the background around the object, over the longer side of its box");
  f("most_cells", o.max_cells, from_to(32, 2048), "", "of the grid along the object's longer side; bounds the time of a frame");
  f("softness", o.softness, from_to(0.3, 10), "cells", "cells over which inside goes over into outside");
  f("band", o.band, from_to(2, 32), "cells", "cells to each side of the outline that are looked at");
  f("registration_steps", o.registration_steps, from_to(0, 200), "", "trials of Gauss-Newton per frame, at most");
  f("reach", o.reach, from_to(0, 200), "px", "pixels that a jump between two frames may be beyond what Gauss-Newton bridges; 0: none is looked for");
  f("shape_steps", o.shape_steps, from_to(0, 200), "", "of the level set per frame");
  f("dt", o.dt, from_to(1e-3, 10), "", "of a step of the level set");
  f("mu", o.mu, from_to(0, 10), "", "of the distance regulariser; mu dt <= 0.2");
  f("tension", o.tension, from_to(0, 4), "", "of the outline; 0: the regulariser as printed, 1: a Laplacian");
  f("least_part", o.min_part, from_to(0, 1), "", "pieces smaller than this share of the largest are dropped");
  f("box_rounds", o.box_rounds, from_to(1, 100), "", "of colours and outline when starting from a box");
  f("drift_cells", o.drift_cells, from_to(0, 64), "cells", "the grid is moved once the shape is so far from its middle");
  f("drift_log_scale", o.drift_log_scale, from_to(0, 1), "", "and once it is larger or smaller than at the start by this much, as a logarithm");
}
// clang-format on

}  // namespace sdftrack::contour
