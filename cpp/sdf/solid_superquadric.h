// SPDX-License-Identifier: MIT
// Superquadrics ((x/a)^(2/e2) + (y/b)^(2/e2))^(e2/e1) + (z/c)^(2/e1) = 1 with e1 and e2 up to 2, which are
// convex: the unit balls of a norm. docs/math/primitives.md, section 9.
#pragma once

#include "base/fast_math.h"
#include "sdf/solid_sample.h"

namespace sdftrack::sdf {

constexpr double kLeastExponent = 0.1, kMostExponent = 2;
constexpr int kTangentPlanes = 6;  // that are tried for a distance
constexpr double kTie_m = 1e-7;    // less is rounding: of planes as far away the last one counts
constexpr double kCloser = 0.5;    // of the way to the foot, which overshoots where a surface curves much
constexpr double kOffAxis = 1e-9;  // least coordinate over its half axis: there is no logarithm of 0

// (u^p + v^p)^(1/p) of positive numbers, p = 2 / e, with derivatives.
template <class T>
struct PowerNorm {
  T value, by_u, by_v;
  T share_u, share_v;  // of u^p and v^p in their sum
  T log_by_e;          // d log value / d e: half the entropy of the shares
};

// Powers of the smaller number over the larger one: nothing overflows.
template <class T>
HD PowerNorm<T> power_norm(T u, T v, T e) {
  const auto u_leads = u > v;
  const T large = select(u_leads, u, v), ratio = select(u_leads, v, u) / large;
  const T log_power = T(2) / e * log_positive(ratio), power = exp_negative(log_power), sum = T(1) + power;
  const T log_sum = log_positive(sum), root = T(1) / exp_negative(T(-0.5) * e * log_sum);
  const T most = T(1) / sum, rest = power / sum;
  const T by_large = root * most, by_small = root * rest / ratio;
  return {large * root,
          select(u_leads, by_large, by_small),
          select(u_leads, by_small, by_large),
          select(u_leads, most, rest),
          select(u_leads, rest, most),
          T(0.5) * (log_sum - rest * log_power)};
}

// The norm of which a superquadric is the unit ball, at a point with no negative coordinate; its derivatives
// by the point and, of its logarithm, by the logarithms of the half axes (minus the shares) and by e1, e2.
template <class T>
struct SuperquadricNorm {
  T value;
  Vec3<T> grad;
  T share[3], log_by_e[2];
};

template <class T>
HD SuperquadricNorm<T> superquadric_norm(Vec3<T> p, Vec3<T> half_axes, T e1, T e2) {
  const auto over = [](T x, T axis) __attribute__((always_inline)) {
    const T u = x / axis;
    return select(u > T(kOffAxis), u, T(kOffAxis));
  };
  const Vec3<T>& a = half_axes;
  const PowerNorm<T> level = power_norm(over(p.x, a.x), over(p.y, a.y), e2);
  const PowerNorm<T> all = power_norm(level.value, over(p.z, a.z), e1);
  return {all.value,
          {all.by_u * level.by_u / a.x, all.by_u * level.by_v / a.y, all.by_v / a.z},
          {all.share_u * level.share_u, all.share_u * level.share_v, all.share_v},
          {all.log_by_e, all.share_u * level.log_by_e}};
}

// The distance is the greatest n . p - h(n) over all unit vectors n, h(n) = max n . q over the solid: the way
// to the farthest tangent plane. The first plane touches the solid between p and the centre, each further one
// at the projection of a point nearer to the foot of p on the one before; last those across the axes. At the
// greatest, n . p - h(n) does not change with n to first order, so its derivatives are those at a fixed n.
template <class T>
HD SolidSample<T, kMaxSizes> superquadric_sample(Vec3<T> point, const T (&size)[kMaxSizes]) {
  const Vec3<T> axes{size[0], size[1], size[2]}, p{abs(point.x), abs(point.y), abs(point.z)};
  SolidSample<T, kMaxSizes> best{T(-1e9), {T(0), T(0), T(0)}, {T(0), T(0), T(0), T(0), T(0)}};
  const auto offer = [&](const SolidSample<T, kMaxSizes>& s, double less_m) __attribute__((always_inline)) {
    const auto better = s.phi_m > best.phi_m - T(less_m);
    best.phi_m = select(better, s.phi_m, best.phi_m);
    best.grad = {select(better, s.grad.x, best.grad.x), select(better, s.grad.y, best.grad.y),
                 select(better, s.grad.z, best.grad.z)};
    for (int i = 0; i < kMaxSizes; ++i) best.size[i] = select(better, s.size[i], best.size[i]);
  };
  Vec3<T> foot = p;
  for (int plane = 0; plane < kTangentPlanes; ++plane) {
    const SuperquadricNorm<T> g = superquadric_norm(foot, axes, size[3], size[4]);
    const T per_slope = T(1) / norm(g.grad);  // h(n), since g.grad . q <= 1 in the solid
    const Vec3<T> n = per_slope * g.grad;
    const T phi = dot(n, p) - per_slope;
    offer({phi,
           n,
           {-per_slope * g.share[0] / axes.x, -per_slope * g.share[1] / axes.y,
            -per_slope * g.share[2] / axes.z, per_slope * g.log_by_e[0], per_slope * g.log_by_e[1]}},
          kTie_m);
    const Vec3<T> touched = (T(1) / g.value) * foot;
    foot = touched + T(plane == 0 ? 1 : kCloser) * (p - phi * n - touched);
  }
  offer({p.x - axes.x, {T(1), T(0), T(0)}, {T(-1), T(0), T(0), T(0), T(0)}}, 0);
  offer({p.y - axes.y, {T(0), T(1), T(0)}, {T(0), T(-1), T(0), T(0), T(0)}}, 0);
  offer({p.z - axes.z, {T(0), T(0), T(1)}, {T(0), T(0), T(-1), T(0), T(0)}}, 0);
  best.grad = {select(point.x < T(0), -best.grad.x, best.grad.x),
               select(point.y < T(0), -best.grad.y, best.grad.y),
               select(point.z < T(0), -best.grad.z, best.grad.z)};
  return best;
}

}  // namespace sdftrack::sdf
