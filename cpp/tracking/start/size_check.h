// SPDX-License-Identifier: MIT
// Whether a shape has the size of what is seen: a wrong unit of mesh or depth is named before and after a
// search for it fails.
#pragma once

#include <string>

#include "tracking/pose_hint.h"
#include "tracking/start/connected_region.h"
#include "tracking/trust/reason.h"

namespace sdftrack::tracking {

// Extent of the measurements in a mask (H * W bytes) along their longest direction, m, without 5 % at each
// end. 0: fewer than 3.
double extent_in(const frame::DepthFrame& frame, const Camera& camera, const unsigned char* mask);

// Diagonal of the box of a shape's surface, and its largest extent in any direction, m; of some of the
// voxels, up to a voxel of these larger.
double size_of(const frame::Shape& shape);
double diameter_of(const frame::Shape& shape);

// Whether the measurements in a mask extend over an eighth to 8 times of the shape's size, or nothing is
// measured there.
bool mask_fits(const frame::DepthFrame& frame, const Camera& camera, const unsigned char* mask,
               const frame::Shape& shape);
// Throws std::invalid_argument, a sentence about `name`, if not.
void check_mask_size(const frame::DepthFrame& frame, const Camera& camera, const unsigned char* mask,
                     const frame::Shape& shape, const std::string& name);

// Throws std::invalid_argument if the shape at this depth would be a speck or many times larger than the
// image.
void check_visible_size(const Camera& camera, double depth_m, const frame::Shape& shape);

// What the extent of the measurements in a mask says about a start there that has failed. No view of an
// object extends over more than its diameter; one may extend over much less, along the longest axis or partly
// hidden.
struct SizeDoubt {
  std::string text;  // empty: nothing
  bool larger = false;
};
SizeDoubt size_doubt(const frame::DepthFrame& frame, const Camera& camera, const unsigned char* mask,
                     const frame::Shape& shape);
// The same for the place of a start: its mask, or what stands alone in the middle of its box.
SizeDoubt size_doubt_at(const frame::DepthFrame& frame, const Camera& camera, const PoseHint& place,
                        const frame::Shape& shape);

std::string length_text(double metres);  // "120 mm", "1.5 m"

}  // namespace sdftrack::tracking
