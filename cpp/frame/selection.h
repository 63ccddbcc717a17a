// SPDX-License-Identifier: MIT
// Selects the pixels that a frame's energies use: first all candidates, then the requested number, packed.
#pragma once

#include <vector>

#include "energies/pixel_set.h"
#include "frame/region.h"

namespace sdftrack::frame {

// Where one object's pixels are searched for, and by which criteria.
struct Lookout {
  Rect rect;
  SelectTerm<float> term;
  RelativeNoise noise;
};
// See PixelSelection::choose.
Lookout lookout_for(const DepthFrame& frame, const Camera& camera, const Shape& shape,
                    const Rigidd& T_cam_obj, const DepthNoiseLaw& noise, double padding_m,
                    const Plane* plane);

class PixelSelection {
 public:
  // Pixels whose points lie in the padded box, except those within 5 mm of the plane, if one is given. The
  // frame's images must live as long as pixels are packed from it.
  void choose(const DepthFrame& frame, const Camera& camera, const Shape& shape, const Rigidd& T_cam_obj,
              const DepthNoiseLaw& noise, double padding_m, const Plane* plane);
  int count() const { return count_; }
  // Packs `requested` of the chosen pixels (all, if fewer), evenly spread in image order. Their noise is
  // relative to the noise at the object's centre.
  void pack(int requested, energies::PixelSet* out) const;

 private:
  std::vector<int> at_;  // index in the depth image; the first count_ entries
  int count_ = 0;
  DepthFrame frame_{};
  Intrinsics<float> K_{};
  RelativeNoise noise_{1, 0};
};

}  // namespace sdftrack::frame
