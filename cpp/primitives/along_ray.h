// SPDX-License-Identifier: MIT
// A ray and a solid in the object frame: where the ray meets the solid, or how close it passes. T: double, or
// a pack of floats whose lanes stop one by one.
#pragma once

#include "sdf/solid_sample.h"

namespace sdftrack::primitives {

constexpr double kGrazing = -0.17;   // cosine of 80 degrees: steeper measurements say little
constexpr double kOnSurface = 2e-5;  // m
constexpr double kStepBack = 0.02;   // m towards the camera, to meet a solid from outside
constexpr int kHitSteps = 5;
constexpr int kCuts = 12;
constexpr double kBracket = 1e-4;  // m
constexpr double kCutGain = 1e-6;  // m: no cut lowers the least value by more

// A point on the ray, and the solid's sample there.
template <class T, int N = sdf::kMaxLengths>
struct RayPlace {
  Vec3<T> p;
  sdf::SolidSample<T, N> s;
};

template <class T, class Mask>
HD Vec3<T> select_vec(Mask mask, const Vec3<T>& a, const Vec3<T>& b) {
  return {select(mask, a.x, b.x), select(mask, a.y, b.y), select(mask, a.z, b.z)};
}
template <class T, int N, class Mask>
HD RayPlace<T, N> select_place(Mask mask, const RayPlace<T, N>& a, const RayPlace<T, N>& b) {
  RayPlace<T, N> out{select_vec(mask, a.p, b.p),
                     {select(mask, a.s.phi_m, b.s.phi_m), select_vec(mask, a.s.grad, b.s.grad), {}}};
  for (int i = 0; i < N; ++i) out.s.size[i] = select(mask, a.s.size[i], b.s.size[i]);
  return out;
}

// The distance along the ray to the solid, m; its derivative is `factor` times the derivative of phi at `at`.
template <class T, int N = sdf::kMaxLengths>
struct RayMeeting {
  T m, factor;
  RayPlace<T, N> at;
};

// From a measurement along `way` (the ray with a depth of 1). Where the ray misses the solid or meets it at a
// grazing angle, the result is phi at the measurement.
template <class T, class Sample>
HD auto meet(const Vec3<T>& from, const Vec3<T>& way, const Sample& sample) {
  using sdftrack::abs;  // sdftrack::primitives also has one
  constexpr int N = decltype(sample(from))::kSizes;
  RayPlace<T, N> here{from, sample(from)};
  RayMeeting<T, N> out{here.s.phi_m, T(1), here};
  T depth = T(0);
  auto going = T(0) < T(1);
  auto forward = going;  // no step back was made
  for (int step = 0;; ++step) {
    const T phi = here.s.phi_m, c = dot(here.s.grad, way), by = phi / c;
    const auto facing = going & (c < T(kGrazing));
    const auto met = facing & (abs(phi) < T(kOnSurface));
    out.m = select(met, depth - by, out.m);
    out.factor = select(met, T(-1) / c, out.factor);
    out.at = select_place(met, here, out.at);
    if (step + 1 == kHitSteps) break;
    // phi is convex: from outside no step overshoots.
    const auto in = facing & (abs(phi) >= T(kOnSurface));
    const auto back = going & forward & (c >= T(kGrazing)) & (phi < T(0));
    going = in | back;
    if (!any(going)) break;
    depth = select(in, depth - by, select(back, depth - T(kStepBack), depth));
    forward = forward & (select(back, T(1), T(0)) < T(1));
    here.p = from + depth * way;
    here.s = sample(here.p);
  }
  return out;
}

// The least phi along a stretch of a ray; its derivative is a mixture of the derivatives at two points.
template <class T, int N = sdf::kMaxLengths>
struct RayClearance {
  T m, share;  // share of `low`
  RayPlace<T, N> low, high;
};

// Between the depths a and b of a ray from `origin` (the camera) along `way`. phi is convex along a line: the
// slopes at both ends of a bracket tell where its least value lies.
template <class T, class Sample>
HD auto least_along(const Vec3<T>& origin, const Vec3<T>& way, T a, T b, const Sample& sample) {
  constexpr int N = decltype(sample(origin))::kSizes;
  using Place = RayPlace<T, N>;
  const auto place = [&](T depth) __attribute__((always_inline)) {
    const Vec3<T> p = origin + depth * way;
    return Place{p, sample(p)};
  };
  Place low = place(a), high = place(b);
  T slope_a = dot(low.s.grad, way), slope_b = dot(high.s.grad, way);
  const auto inside = (slope_a < T(0)) & (slope_b > T(0));
  const auto at_low = slope_a >= T(0);
  // The depth at which the two tangents meet.
  const auto meeting = [&]() __attribute__((always_inline)) {
    return a + (high.s.phi_m - low.s.phi_m - slope_b * (b - a)) / (slope_a - slope_b);
  };
  auto going = inside & (b - a > T(kBracket));
  for (int cut = 0; cut < kCuts && any(going); ++cut) {
    // The meeting point is exact for the flat faces of a box; for other solids it is kept away from the ends.
    constexpr double kEdge = 0.5 * kBracket;
    T t = T(0.5) * (a + b);
    if (cut % 3 != 2) {
      t = meeting();
      t = select(t < a + T(kEdge), a + T(kEdge), t);
      t = select(t > b - T(kEdge), b - T(kEdge), t);
    }
    const Place middle = place(t);
    const T slope = dot(middle.s.grad, way);
    const auto falls = going & (slope < T(0)), rises = going & (slope >= T(0));
    a = select(falls, t, a), slope_a = select(falls, slope, slope_a);
    b = select(rises, t, b), slope_b = select(rises, slope, slope_b);
    low = select_place(falls, middle, low), high = select_place(rises, middle, high);
    // phi lies above both tangents: no cut finds a value lower than the one where they meet.
    const T bound = low.s.phi_m + slope_a * (meeting() - a);
    const T least = select(high.s.phi_m < low.s.phi_m, high.s.phi_m, low.s.phi_m);
    going = going & (least - bound >= T(kCutGain)) & (b - a > T(kBracket));
  }
  // At an edge phi has a kink; its derivative is the mixture of both sides that is level along the ray.
  const T end = select(at_low, low.s.phi_m, high.s.phi_m), of_low = select(at_low, T(1), T(0));
  const T met = low.s.phi_m + slope_a * (meeting() - a);
  return RayClearance<T, N>{select(inside, met, end), select(inside, slope_b / (slope_b - slope_a), of_low),
                            low, high};
}

// meet() for a solid with these lengths, by the solid's own closed form if it has one.
template <class Solid, class T>
HD auto meet_solid(const Vec3<T>& from, const Vec3<T>& way, const T (&size)[sdf::kMaxSizes]) {
  if constexpr (requires { Solid::meet(from, way, size); })
    return Solid::meet(from, way, size);
  else
    return meet(
        from, way, [&](const Vec3<T>& p) __attribute__((always_inline)) { return Solid::sample(p, size); });
}
template <class Solid, class T>
HD auto least_along_solid(const Vec3<T>& origin, const Vec3<T>& way, T a, T b,
                          const T (&size)[sdf::kMaxSizes]) {
  if constexpr (requires { Solid::least_along(origin, way, a, b, size); })
    return Solid::least_along(origin, way, a, b, size);
  else
    return least_along(
        origin, way, a,
        b, [&](const Vec3<T>& p) __attribute__((always_inline)) { return Solid::sample(p, size); });
}

}  // namespace sdftrack::primitives
