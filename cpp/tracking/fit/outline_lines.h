// SPDX-License-Identifier: MIT
// Lines across an object's outline in the colour image, and where the colours place the outline on each line.
#pragma once

#include "appearance/local_colors.h"
#include "energies/outline_energy.h"
#include "frame/region.h"
#include "tracking/fit/contour_library.h"
#include "tracking/trust/neighbors.h"

namespace sdftrack::tracking {

struct OutlineSearch {
  int points = 200;                   // places on the outline to evaluate
  int reach_px = 8;                   // to both sides along a line
  double in_front_m = 0.010;          // depth nearer than the outline by more than this hides it
  const Neighbors* beside = nullptr;  // other objects, next to which the colours around an outline differ
};

struct OutlineColors {
  const appearance::ColorModel* whole = nullptr;   // nullptr: not known
  const appearance::LocalColors* local = nullptr;  // nullptr: none
};

// At T_cam_obj (centred). No line where something stands in front, where a neighbour is seen, where the line
// leaves the image, or where the colours on its two sides do not differ. The frame needs colours, not depth.
// Returns the number of places evaluated.
int find_outline_lines(const frame::DepthFrame& frame, const Camera& camera, const frame::Shape& shape,
                       const OutlineColors& colors, const Rigidd& T_cam_obj, const OutlineSearch& search,
                       ContourLibrary* contours, energies::OutlineLines* out);

// Learns the colours on both sides of the outline at a reliable pose. Inside, colours that the whole object's
// histograms assign to something else are left out.
void learn_outline_colors(const frame::DepthFrame& frame, const Camera& camera, const frame::Shape& shape,
                          const appearance::ColorModel& whole, const Rigidd& T_cam_obj,
                          const OutlineSearch& search, ContourLibrary* contours,
                          appearance::LocalColors* colors);

}  // namespace sdftrack::tracking
