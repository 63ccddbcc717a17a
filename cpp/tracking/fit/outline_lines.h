// SPDX-License-Identifier: MIT
// Lines across an object's outline in the colour image, and where on each the colours put the outline.
#pragma once

#include <vector>

#include "appearance/local_colors.h"
#include "energies/outline_energy.h"
#include "frame/region.h"
#include "tracking/fit/contour_library.h"
#include "tracking/trust/neighbors.h"

namespace sdftrack::tracking {

struct OutlineSearch {
  int points = 200;                   // of the outline that are looked at
  int reach_px = 8;                   // to both sides along a line
  double in_front_m = 0.010;          // what is read by more than this in front of the outline hides it
  const Neighbors* beside = nullptr;  // other objects, next to which an outline has other colours around it
};

struct OutlineColors {
  const appearance::ColorModel* whole = nullptr;   // nullptr: not known
  const appearance::LocalColors* local = nullptr;  // nullptr: none
};

// At T_cam_obj (centred). No line where something stands in front or a neighbour is seen, where it leaves the
// image, and where the colours on its two sides do not differ. The frame needs colours, not depth. Returns
// how many places it has looked at.
int find_outline_lines(const frame::DepthFrame& frame, const Camera& camera, const frame::Shape& shape,
                       const OutlineColors& colors, const Rigidd& T_cam_obj, const OutlineSearch& search,
                       ContourLibrary* contours, energies::OutlineLines* out);

// The colours on both sides of the outline at a pose that is sure; inside, those that the whole object's
// histograms do not take for something else.
void learn_outline_colors(const frame::DepthFrame& frame, const Camera& camera, const frame::Shape& shape,
                          const appearance::ColorModel& whole, const Rigidd& T_cam_obj,
                          const OutlineSearch& search, ContourLibrary* contours,
                          appearance::LocalColors* colors);

}  // namespace sdftrack::tracking
