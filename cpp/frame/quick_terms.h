// SPDX-License-Identifier: MIT
// The contribution of one point to a rough fit (outline points: energies/outline_term.h).
#pragma once

#include "energies/outline_term.h"
#include "energies/penalty.h"

namespace sdftrack::frame {

// How strongly a measurement pulls the pose.
template <class T>
struct PullTerm {
  energies::DepthLogistic<T> penalty;
  const float *hit_m, *depth_m, *per_noise;

  template <class U>
  HD PullTerm<U> cast() const {
    return {penalty.template cast<U>(), hit_m, depth_m, per_noise};
  }
  HD T pull(int i, int n) const {
    const T residual_m = load<T>(hit_m + i, n) - load<T>(depth_m + i, n);
    return penalty.scale_m * penalty(residual_m, load<T>(per_noise + i, n)).slope;
  }
};

using energies::contribution_of;
using energies::OutlineTerm;
using energies::PointsView;

// The nodes of a SearchScene.
struct NodesView {
  const float* depth_m;
  int x0, y0, step, width, height;
};

// phi at a measurement. `solid`: measurements of other objects; they count only deeper inside than the
// margin, where the object cannot be, since it would hide them.
template <class T>
struct ReadingTerm {
  energies::SingleObject<T> field;
  energies::DepthLogistic<T> penalty;
  PointsView readings_cam;
  bool solid;
  T margin_m;

  template <class U>
  HD ReadingTerm<U> cast() const {
    return {field.template cast<U>(), penalty.template cast<U>(), readings_cam, solid, U(margin_m)};
  }
  HD energies::Contribution<T, 6> linearize(IntOf<T> k) const {
    const Vec3<T> p_obj = field.T_obj_cam * readings_cam.at<T>(k);
    T phi;
    Vec3<T> g;
    sample(field.sdf, p_obj, &phi, &g);
    if (solid) phi = phi + margin_m;
    return contribution_of(penalty(phi, T(1)), g, p_obj, solid ? phi < T(0) : T(0) <= T(0));
  }
};

// Whether a measurement lies on the surface, on a side that faces the camera.
template <class T>
struct ExplainedTerm {
  energies::SingleObject<T> field;
  PointsView readings_cam;
  T tolerance_m;

  template <class U>
  HD ExplainedTerm<U> cast() const {
    return {field.template cast<U>(), readings_cam, U(tolerance_m)};
  }
  HD auto explains(IntOf<T> k) const {
    const Vec3<T> p_cam = readings_cam.at<T>(k);
    T phi;
    Vec3<T> g;
    sample(field.sdf, field.T_obj_cam * p_cam, &phi, &g);
    return (abs(phi) < tolerance_m) & (dot(g, field.T_obj_cam.R * p_cam) < T(0));
  }
};

constexpr float kFacing = 0.2f;  // cosine of the incidence below which a surface point is not used

// The distance of a surface point's tangent plane from the measurement at the pixel where the point should be
// seen. Measurements of other objects do not disturb it, since only these pixels are used.
template <class T>
struct SurfaceTerm {
  Rigid<T> T_cam_obj;
  Intrinsics<T> K;
  energies::DepthLogistic<T> penalty;
  NodesView nodes;
  PointsView points_obj, normals_obj;

  template <class U>
  HD SurfaceTerm<U> cast() const {
    return {T_cam_obj.template cast<U>(),
            K.template cast<U>(),
            penalty.template cast<U>(),
            nodes,
            points_obj,
            normals_obj};
  }
  HD energies::Contribution<T, 6> linearize(IntOf<T> k) const {
    const Vec3<T> p_obj = points_obj.at<T>(k), n_obj = normals_obj.at<T>(k), p = T_cam_obj * p_obj,
                  n_cam = T_cam_obj.R * n_obj;
    const T inv = T(1.0f / float(nodes.step)), half = T(0.5f);
    const Vec2<T> u = project(K, p);
    const T x = (u.x - T(float(nodes.x0))) * inv + half, y = (u.y - T(float(nodes.y0))) * inv + half;
    const auto within = (x > T(0)) & (y > T(0)) & (x < T(float(nodes.width))) & (y < T(float(nodes.height))) &
                        (p.z > T(1e-3f)) & (dot(n_cam, p) <= T(-kFacing) * p.z);
    const IntOf<T> i = truncate(select(within, x, T(0))), j = truncate(select(within, y, T(0)));
    const T z = gather<T>(nodes.depth_m, j * nodes.width + i), step = T(float(nodes.step));
    const Vec3<T> r = ray(K, T(float(nodes.x0)) + real<T>(i) * step, T(float(nodes.y0)) + real<T>(j) * step);
    const T residual = dot(n_cam, z * r - p);
    return contribution_of(penalty(residual, T(1)), n_obj, p_obj, within & (z > T(0)));
  }
};

}  // namespace sdftrack::frame
