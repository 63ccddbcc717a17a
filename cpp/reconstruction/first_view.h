// SPDX-License-Identifier: MIT
// What the first frame of a recording leaves for the object: behind its mask, or behind what hides it, and
// above the planes that it stands on or before (docs/math/reconstruction.md, section 5).
#pragma once

#include <vector>

#include "base/camera.h"
#include "base/rigid.h"

namespace sdftrack::reconstruction {

struct PlaneBelow {
  Vec3d normal_cam;
  double offset_m;  // the plane: normal . p + offset = 0
  double thick_m;   // readings lower than this are its own
};

// About where the object is. A plane that a lens bends leaves the one fitted beside the object.
struct Place {
  Vec3d middle_cam;
  double radius_m;
};

class FirstView {
 public:
  // from_m: for each pixel of the camera's image the least depth at which the object may be: 0 in its mask,
  // more than that in the margin about it, infinite where it cannot be. Planes in the same camera's frame.
  FirstView(const Camera& camera, const Rigidd& T_cam_obj, std::vector<float> from_m,
            std::vector<PlaneBelow> planes, const Place& place);

  // Whether a reading there may be the object's.
  bool may_hold(Vec3d p_obj) const {
    const Vec3d p = T_cam_obj_ * p_obj;
    return above(p, 1) && p.z > 0 && p.z >= from(p);
  }
  // Whether anything of the object can be there: in (12) and above the planes themselves, not their
  // thickness.
  bool leaves_room(Vec3d p_obj) const {
    const Vec3d p = T_cam_obj_ * p_obj;
    return above(p, 0) && p.z > 0 && p.z >= from(p);
  }
  // Whether a guess of the object may reach there: down to the planes, and nowhere beside the mask.
  bool may_be_guessed(Vec3d p_obj) const {
    const Vec3d p = T_cam_obj_ * p_obj;
    return above(p, 0) && p.z > 0 && !(from(p) > 0);
  }

 private:
  bool above(Vec3d p_cam, double thicknesses) const;
  double from(Vec3d p_cam) const;

  Camera camera_;
  Rigidd T_cam_obj_;
  std::vector<float> from_m_;
  std::vector<PlaneBelow> planes_;
  Place place_;
};

}  // namespace sdftrack::reconstruction
