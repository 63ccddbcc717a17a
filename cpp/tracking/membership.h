// SPDX-License-Identifier: MIT
// The soft assignment of each pixel to the objects (thesis Eq. 5.21), for display or cutting out.
#pragma once

#include <vector>

#include "tracking/frame_context.h"

namespace sdftrack::tracking {

class Membership {
 public:
  explicit Membership(const TrackerOptions& options) : options_(options) {}

  // H * W * M soft weights of the last poses in this frame, and H * W probabilities by colour that a pixel
  // shows an object (NaN: not known).
  void find(const FrameContext& context, const std::vector<TrackedObject>& objects, float* membership,
            float* foreground);
  // The same for the pixels of a box, row by row: the probability by colour; NaN where not known.
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
