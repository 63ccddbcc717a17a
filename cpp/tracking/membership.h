// SPDX-License-Identifier: MIT
// Whose each pixel is, softly (thesis Eq. 5.21): for those who want to see it, or to cut objects out of an
// image.
#pragma once

#include <vector>

#include "tracking/frame_context.h"

namespace sdftrack::tracking {

class Membership {
 public:
  explicit Membership(const TrackerOptions& options) : options_(options) {}

  // H * W * M soft weights of the last poses in this frame, and H * W the chance by colour that a pixel is an
  // object's (NaN: not known).
  void find(const FrameContext& context, const std::vector<TrackedObject>& objects, float* membership,
            float* foreground);
  // The chance by colour that a pixel of the box is the object's: of the box alone, row by row, NaN where not
  // known.
  void find_foreground(const FrameContext& context, const TrackedObject& object, const frame::Rect& box,
                       std::vector<float>* foreground);

 private:
  void add_foreground(const FrameContext& context, const TrackedObject& object, const frame::Rect& box,
                      float* foreground);

  TrackerOptions options_;
  ColorReader color_reader_;
  std::vector<float> foreground_;
};

}  // namespace sdftrack::tracking
