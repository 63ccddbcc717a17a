// SPDX-License-Identifier: MIT
// The ray functions of along_ray.h for a ball or an ellipsoid: g = sum (p_i / a_i)^2 is quadratic along the
// ray. Where g is 1 the ray meets the surface; the minimum of g is close to the minimum of the distance.
#pragma once

#include "primitives/along_ray.h"
#include "sdf/solid_ellipsoid.h"

namespace sdftrack::primitives {

constexpr int kSecants = 6;           // points along a ray
constexpr double kSecantGain = 1e-7;  // m: no secant lowers the least value by more

template <class T>
HD Vec3<T> over(const Vec3<T>& p, const T (&radii)[sdf::kMaxSizes]) {
  return {p.x / radii[0], p.y / radii[1], p.z / radii[2]};
}

// The value of ellipsoid_sample() at a point of the surface.
template <class T>
HD sdf::SolidSample<T> on_ellipsoid(const Vec3<T>& q, const T (&radii)[sdf::kMaxSizes]) {
  using sdftrack::sqrt;  // sdftrack::primitives also has one
  const Vec3<T> u = over(q, radii), m = over(u, radii), n = (T(1) / sqrt(dot(m, m))) * m;
  return {T(0), n, {-u.x * n.x, -u.y * n.y, -u.z * n.z}};
}

// `sample`: phi and its derivatives, used where the ray does not meet the solid.
template <class T, class Sample>
HD RayMeeting<T> meet_ellipsoid(const Vec3<T>& from, const Vec3<T>& way, const T (&radii)[sdf::kMaxSizes],
                                const Sample& sample) {
  using sdftrack::sqrt;
  const Vec3<T> u = over(from, radii), v = over(way, radii), m = over(u, radii);
  const T a = dot(v, v), b = dot(u, v), c = dot(u, u) - T(1), square = b * b - a * c;
  const auto hits = square > T(0);
  const T root = sqrt(select(hits, square, T(0)));
  // The nearer of the two roots, in the form whose terms do not cancel.
  const T depth = select(b < T(0), c / (root - b), (-b - root) / a);
  const RayPlace<T> hit{from + depth * way, on_ellipsoid(from + depth * way, radii)};
  const T cosine = dot(hit.s.grad, way);
  // A point behind the solid, or deeper inside than one step back can leave, does not meet it.
  const T least = select(c > T(0), T(0), select(b < T(kGrazing) * sqrt(dot(m, m)), T(-1e9), T(-kStepBack)));
  const auto met = hits & (cosine < T(kGrazing)) & (depth >= least);
  if (all(met)) return {depth, T(-1) / cosine, hit};
  const RayPlace<T> here{from, sample(from)};
  return {select(met, depth, here.s.phi_m), select(met, T(-1) / cosine, T(1)), select_place(met, hit, here)};
}

// Secant steps on phi's slope, which rises along the ray, from the minimum of g.
template <class T>
HD RayClearance<T> least_along_ellipsoid(const Vec3<T>& origin, const Vec3<T>& way, T a, T b,
                                         const T (&radii)[sdf::kMaxSizes]) {
  using sdftrack::abs, sdftrack::sqrt;
  const auto within = [&](T depth) __attribute__((always_inline)) {
    depth = select(depth < a, a, depth);
    return select(depth > b, b, depth);
  };
  const Vec3<T> u = over(origin, radii), v = over(way, radii);
  const T rise = dot(v, v);
  T depth = within(-dot(u, v) / rise);
  const auto place = [&](T at) __attribute__((always_inline)) {
    const Vec3<T> p = origin + at * way;
    return RayPlace<T>{p, sdf::ellipsoid_sample(p, radii)};
  };
  RayPlace<T> here = place(depth);
  T slope = dot(here.s.grad, way);
  const Vec3<T> m = over(over(here.p, radii), radii);
  T curvature = rise / sqrt(dot(m, m));  // of (g - 1) / |grad g|
  auto going = T(0) < T(1);
  for (int n = 0; n < kSecants; ++n) {
    a = select(going & (slope < T(0)), depth, a), b = select(going & (slope >= T(0)), depth, b);
    const T next = within(depth - slope / curvature), by = next - depth;
    going = going & (abs(slope * by) > T(2 * kSecantGain));
    if (!any(going)) break;
    const RayPlace<T> there = place(next);
    const T slope_there = dot(there.s.grad, way), risen = (slope_there - slope) / select(going, by, T(1));
    curvature = select(going & (risen > T(0)), risen, curvature);
    depth = select(going, next, depth), slope = select(going, slope_there, slope);
    here = select_place(going, there, here);
  }
  return {here.s.phi_m, T(1), here, here};
}

}  // namespace sdftrack::primitives
