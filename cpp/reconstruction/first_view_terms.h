// SPDX-License-Identifier: MIT
// Where a first view leaves room for the object (first_view.h), for the CPU and the GPU.
#pragma once

#include "base/lens_pixel.h"
#include "base/rigid.h"
#include "base/to_int.h"
#include "levelset/eikonal_terms.h"

namespace sdftrack::reconstruction {

struct PlaneBelow {
  Vec3d normal_cam;
  double offset_m;  // the plane: normal . p + offset = 0
  double thick_m;   // measurements lower than this belong to the plane
};

// The approximate place of the object: a bent plane departs from the one fitted next to it.
struct Place {
  Vec3d middle_cam;
  double radius_m;
  double guessed_to_m = 0;  // depth at which the first guess ends
};

constexpr double kBend = 0.1;   // of a plane, per distance from the object
constexpr double kWider = 1.1;  // than its ball is the object at most

struct FirstViewTerm {
  LensRays lens;
  int width, height;
  Rigidd T_cam_obj;
  Place place;
  const float* from_m;  // borrowed, as are the planes
  const PlaneBelow* planes;
  int plane_count;

  // Whether a measurement there may be the object's.
  HD bool may_hold(Vec3d p_obj) const {
    const Vec3d p = T_cam_obj * p_obj;
    return above(p, 1) && p.z > 0 && p.z >= from(p);
  }
  // Whether the object can be there: within (12), and above the planes without their thickness.
  HD bool leaves_room(Vec3d p_obj) const {
    const Vec3d p = T_cam_obj * p_obj;
    return above(p, 0) && p.z > 0 && p.z >= from(p);
  }
  // Whether a guess of the object may reach there: down to the planes, and only within the mask.
  HD bool may_be_guessed(Vec3d p_obj) const {
    const Vec3d p = T_cam_obj * p_obj;
    return above(p, 0) && p.z > 0 && !(from(p) > 0);
  }
  HD bool behind_first_guess(Vec3d p_obj) const { return (T_cam_obj * p_obj).z > place.guessed_to_m; }
  // How far (m) a point may be in front of the object's far side, and inside the ball around it; negative:
  // behind it. Far behind where there is no guess.
  HD double before_far_side(Vec3d p_obj) const {
    const Vec3d p = T_cam_obj * p_obj;
    const double from_m = from(p), within_m = kWider * place.radius_m - norm(p - place.middle_cam);
    if (!above(p, 0) || !(p.z > 0) || !(from_m < 0)) return -place.radius_m;
    return levelset::least(-from_m - p.z, within_m);
  }

 private:
  HD bool above(Vec3d p_cam, double thicknesses) const {
    const double away_m = levelset::most(0.0, norm(p_cam - place.middle_cam) - place.radius_m);
    for (int k = 0; k < plane_count; ++k) {
      const PlaneBelow& plane = planes[k];
      if (dot(plane.normal_cam, p_cam) + plane.offset_m < thicknesses * plane.thick_m + kBend * away_m)
        return false;
    }
    return true;
  }
  // The least depth at a point's pixel, or at the nearest border pixel: how far an object that the border
  // cuts extends outside the image is unknown.
  HD double from(Vec3d p_cam) const {
    const Vec2d u = lens_pixel(lens, p_cam);
    const int x = to_int_within(u.x + 0.5, 0, width - 1), y = to_int_within(u.y + 0.5, 0, height - 1);
    return double(from_m[y * width + x]);
  }
};

}  // namespace sdftrack::reconstruction
