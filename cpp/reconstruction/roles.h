// SPDX-License-Identifier: MIT
// Which measurements are an object's, by their colours and by how they are connected.
#pragma once

#include <functional>
#include <vector>

#include "levelset/evidence_image.h"
#include "reconstruction/role_terms.h"

namespace sdftrack::reconstruction {

class RoleFinder {
 public:
  // distance_m: distance of each measurement of the rectangle from the current surface, NaN without a
  // measurement; foreground: probability by colour, NaN if unknown, or nullptr; has_room: whether the object
  // can be at the measurement of pixel (x, y), called only where all other criteria hold. A measurement is
  // the object's if its colour allows it and it is connected to measurements on the current surface; any
  // other lies behind or in front of the object.
  const std::vector<levelset::PixelRole>& find(const levelset::PixelRect& rect,
                                               const std::vector<float>& distance_m, const float* foreground,
                                               const ImageView<float>& depth_m, const RoleOptions& options,
                                               const std::function<bool(int x, int y)>& has_room);
  // Roles by colour alone: the object's where its colour is more probable than the background's (thesis,
  // below 4.23). nullptr: no pixel's colour is known.
  const std::vector<levelset::PixelRole>* from_colors(const levelset::PixelRect& rect,
                                                      const ImageView<float>& depth_m,
                                                      const float* foreground);
  // Roles from a mask of the whole image (not 0: the object's).
  const std::vector<levelset::PixelRole>& from_mask(const levelset::PixelRect& rect,
                                                    const ImageView<float>& depth_m,
                                                    const unsigned char* mask);

 private:
  std::vector<levelset::PixelRole> roles_;
  std::vector<int> open_;
};

}  // namespace sdftrack::reconstruction
