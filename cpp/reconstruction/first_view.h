// SPDX-License-Identifier: MIT
// The space that the first frame of a recording leaves for the object: behind its mask or behind what hides
// it, and above the planes that it stands on or in front of (docs/math/reconstruction.md, section 5).
#pragma once

#include <vector>

#include "reconstruction/first_view_terms.h"

namespace sdftrack::reconstruction {

class FirstView {
 public:
  // from_m: for each pixel of the camera's image, the least depth of the object: more than 0 in the margin
  // around its mask, infinite where the object cannot be. Otherwise 0, or minus the depth of its far side.
  // The planes are in the same camera's frame.
  FirstView(const Camera& camera, const Rigidd& T_cam_obj, std::vector<float> from_m,
            std::vector<PlaneBelow> planes, const Place& place);

  // For points in the object frame, see first_view_terms.h.
  bool may_hold(Vec3d p_obj) const { return term().may_hold(p_obj); }
  bool leaves_room(Vec3d p_obj) const { return term().leaves_room(p_obj); }
  bool may_be_guessed(Vec3d p_obj) const { return term().may_be_guessed(p_obj); }
  double before_far_side(Vec3d p_obj) const { return term().before_far_side(p_obj); }
  bool behind_first_guess(Vec3d p_obj) const { return term().behind_first_guess(p_obj); }
  bool has_far_side() const;

  // The term's arrays belong to this view.
  const FirstViewTerm& term() const { return term_; }
  const std::vector<float>& from_m() const { return from_m_; }
  const std::vector<PlaneBelow>& planes() const { return planes_; }

 private:
  std::vector<float> from_m_;
  std::vector<PlaneBelow> planes_;
  FirstViewTerm term_;
};

}  // namespace sdftrack::reconstruction
