// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <vector>

#include "base/rigid.h"
#include "frame/region.h"

namespace sdftrack::tracking {

// Where an object is at a start: at a pose, else in a mask, else in a box, else anywhere.
struct PoseHint {
  std::optional<Rigidd> T_cam_obj;  // of the caller's object frame
  std::vector<unsigned char> mask;  // H * W, 0: not the object; empty: none
  std::optional<frame::Rect> box;   // of depth pixels

  template <class Archive, class Self>
  static void visit(Archive& archive, Self& self) {
    auto& [T, pixels, rect] = self;
    archive(T, pixels, rect);
  }
};

}  // namespace sdftrack::tracking
