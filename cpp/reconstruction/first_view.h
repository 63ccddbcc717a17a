// SPDX-License-Identifier: MIT
// What the first frame of a recording leaves for the object: behind its mask, or behind what hides it, and
// above the planes that it stands on or before (docs/math/reconstruction.md, section 5).
#pragma once

#include <vector>

#include "reconstruction/first_view_terms.h"

namespace sdftrack::reconstruction {

class FirstView {
 public:
  // from_m: for each pixel of the camera's image the least depth at which the object may be: 0 in its mask,
  // more than that in the margin about it, infinite where it cannot be. Planes in the same camera's frame.
  FirstView(const Camera& camera, const Rigidd& T_cam_obj, std::vector<float> from_m,
            std::vector<PlaneBelow> planes, const Place& place);

  // Of points of the object: first_view_terms.h.
  bool may_hold(Vec3d p_obj) const { return term().may_hold(p_obj); }
  bool leaves_room(Vec3d p_obj) const { return term().leaves_room(p_obj); }
  bool may_be_guessed(Vec3d p_obj) const { return term().may_be_guessed(p_obj); }

  // Its arrays are this view's.
  const FirstViewTerm& term() const { return term_; }
  const std::vector<float>& from_m() const { return from_m_; }
  const std::vector<PlaneBelow>& planes() const { return planes_; }

 private:
  std::vector<float> from_m_;
  std::vector<PlaneBelow> planes_;
  FirstViewTerm term_;
};

}  // namespace sdftrack::reconstruction
