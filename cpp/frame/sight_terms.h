// SPDX-License-Identifier: MIT
// What the camera should see of a surface point at a pose: the formula for one point.
#pragma once

#include "base/camera.h"
#include "base/rigid.h"
#include "base/views.h"
#include "energies/points_view.h"

namespace sdftrack::frame {

using energies::PointsView;

constexpr float kSeenFacing = 0.25f;  // cosine of the incidence below which a point is not used
constexpr int kMarchSteps = 24, kNearSteps = 4;

// Surface points as a camera sees them. `facing`: cosine of the incidence; 0: turned away or hidden.
template <class T>
struct Sight {
  T facing;
  Vec3<T> p_cam;
};

template <class T>
struct SightTerm {
  SdfView sdf;     // near the point
  SdfView coarse;  // farther along the ray: fewer voxels, which fit the cache
  Rigid<T> T_cam_obj;
  Vec3<T> eye_obj;
  T leave_m;  // farther than this from a point the object has ended
  PointsView points_obj, normals_obj;

  template <class U>
  HD SightTerm<U> cast() const {
    return {sdf,        coarse,     T_cam_obj.template cast<U>(), eye_obj.template cast<U>(), U(leave_m),
            points_obj, normals_obj};
  }

  HD auto faces(IntOf<T> k) const {
    const Vec3<T> d = eye_obj - points_obj.at<T>(k);
    return dot(normals_obj.at<T>(k), d) >= T(kSeenFacing) * norm(d);
  }
  // The sight of a point that faces the camera.
  HD Sight<T> look(IntOf<T> k) const {
    const Vec3<T> p = points_obj.at<T>(k), n = normals_obj.at<T>(k), d = eye_obj - p;
    const Vec3<T> to_eye = (T(1) / norm(d)) * d;
    return {select(march(p, n, to_eye) > T(0), dot(n, to_eye), T(0)), T_cam_obj * p};
  }

 private:
  // Marches towards the camera through the field: 0 where the ray is blocked, also at its start.
  HD T march(Vec3<T> p, Vec3<T> normal, Vec3<T> to_eye) const {
    const T voxel = T(sdf.voxel_m);
    const Vec3<T> start = p + (T(1.5f) * voxel) * normal;
    T t = voxel, open = T(1);
    for (int k = 0; k < kMarchSteps; ++k) {
      const auto goes_on = (open > T(0)) & (t < leave_m);
      if (!any(goes_on)) break;
      T phi;
      Vec3<T> unused;
      sample(k < kNearSteps ? sdf : coarse, start + t * to_eye, &phi, &unused);
      open = select(goes_on & (phi < T(0.1f) * voxel), T(0), open);
      t = select(goes_on, t + select(phi > voxel, phi, voxel), t);
    }
    return open;
  }
};

// The position of a surface point around the centre of the object's image, in pixels of the ideal pinhole.
template <class T>
struct Bearing {
  T turn;       // 0..1 once around
  T radius_px;  // negative: behind the camera
  T depth_m;
};

template <class T>
struct BearingTerm {
  Rigid<T> T_cam_obj;
  Intrinsics<T> K;
  Vec2<T> middle_px;
  PointsView points_obj;

  template <class U>
  HD BearingTerm<U> cast() const {
    return {T_cam_obj.template cast<U>(), K.template cast<U>(), {U(middle_px.x), U(middle_px.y)}, points_obj};
  }

  HD Bearing<T> look(IntOf<T> k) const {
    const Vec3<T> p = T_cam_obj * points_obj.at<T>(k);
    const Vec2<T> u = project(K, p);
    const T x = u.x - middle_px.x, y = u.y - middle_px.y;
    return {turn_of(x, y), select(p.z > T(1e-3f), sqrt(x * x + y * y), T(-1)), p.z};
  }

 private:
  // (atan2(y, x) / pi + 1) / 2, to 1e-4: enough for two dozen directions.
  static HD T turn_of(T x, T y) {
    const T a = abs(x), b = abs(y);
    const T large = select(a > b, a, b), small = select(a > b, b, a);
    const T q = small / select(large > T(1e-6f), large, T(1e-6f)), q2 = q * q;
    T angle = q * (T(0.15841614f) + q2 * (T(-0.0459465f) + q2 * T(0.01262722f)));  // atan(q) / 2 pi
    angle = select(a > b, angle, T(0.25f) - angle);
    angle = select(x >= T(0), angle, T(0.5f) - angle);
    return T(0.5f) + copysign(angle, y);
  }
};

}  // namespace sdftrack::frame
