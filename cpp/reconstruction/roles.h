// SPDX-License-Identifier: MIT
// Which readings are an object's, by their colours and by how they hang together.
#pragma once

#include <functional>
#include <vector>

#include "levelset/evidence_image.h"
#include "reconstruction/role_terms.h"

namespace sdftrack::reconstruction {

class RoleFinder {
 public:
  // distance_m: of each reading of the rectangle from the surface so far, NaN where there is no reading;
  // foreground: chance by colour, NaN where not known, or nullptr; has_room: whether the object can be where
  // pixel (x, y) of the image is read, asked only where all else speaks for it. A reading is the object's
  // where its colour may be and it hangs together with readings on the surface so far; any other lies beyond
  // it or before it.
  const std::vector<levelset::PixelRole>& find(const levelset::PixelRect& rect,
                                               const std::vector<float>& distance_m, const float* foreground,
                                               const ImageView<float>& depth_m, const RoleOptions& options,
                                               const std::function<bool(int x, int y)>& has_room);
  // The same by colour alone: where it is rather the object's than the background's (thesis, below 4.23).
  // nullptr: of no pixel it is known.
  const std::vector<levelset::PixelRole>* from_colors(const levelset::PixelRect& rect,
                                                      const ImageView<float>& depth_m,
                                                      const float* foreground);
  // The same from a mask (not 0: the object's), of the whole image.
  const std::vector<levelset::PixelRole>& from_mask(const levelset::PixelRect& rect,
                                                    const ImageView<float>& depth_m,
                                                    const unsigned char* mask);

 private:
  std::vector<levelset::PixelRole> roles_;
  std::vector<int> open_;
};

}  // namespace sdftrack::reconstruction
