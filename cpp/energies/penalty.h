// SPDX-License-Identifier: MIT
// Penalties: the cost of a residual, the slope of the cost, and a curvature >= 0 for the normal equations.
#pragma once

#include "base/fast_math.h"

namespace sdftrack::energies {

template <class T>
struct Curve {
  T cost, slope, curvature;
};

enum class Curvature {
  kIrls,     // slope / residual: the quadratic that touches the cost
  kPrinted,  // slope^2: J^T J of the log-likelihood's gradient (thesis Eq. 3.18), zero at residual 0
};

// -log(a sech^2(r / 2s) + b): a share of pixels with a logistic residual over a constant share of others.
// With b = 0, a is left out, because it adds only a constant.
template <class T>
HD Curve<T> logistic_mixture(T residual_m, T per_s, T a, T b, Curvature curvature) {
  const T u = T(0.5) * abs(residual_m) * per_s;
  // With d = e^(-2u): tanh u = (1 - d) / (1 + d), sech^2 u = 4 d / (1 + d)^2, all without overflow.
  const T d = exp_negative(T(-2) * u), up = T(1) + d;
  const T data = a * T(4) * d, likelihood = data + b * up * up;  // times up^2
  // One division replaces three: by up, by the likelihood and by u. Near 0, u is left out.
  const auto near = u < T(1e-3);
  const T divisor = select(near, T(1), u), inv = T(1) / (up * likelihood * divisor);
  const T per_up = likelihood * divisor * inv;
  const T tanh_u = (T(1) - d) * per_up;
  const auto floored = b > T(0);
  const T inlier = select(floored, data * up * divisor * inv, T(1));
  T cost = -log_positive(likelihood * per_up * per_up);
  if (!all(floored)) cost = select(floored, cost, T(2) * (u + log_positive(up) - T(0.6931471805599453)));
  const T slope = inlier * tanh_u * per_s;
  const T tanh_per_u = select(near, T(1), tanh_u * (up * likelihood * inv));
  const T irls = T(0.5) * inlier * per_s * per_s * tanh_per_u;
  return {cost, copysign(slope, residual_m), curvature == Curvature::kIrls ? irls : slope * slope};
}

// d^2 cost / d residual^2 of logistic_mixture, negative where it redescends; for the sandwich covariance.
template <class T>
HD T logistic_mixture_second(T residual_m, T per_s, T a, T b) {
  const T t = fast_tanh(T(0.5) * residual_m * per_s), sech2 = T(1) - t * t;
  const T likelihood = a * sech2 + b;
  const T inlier = select(b > T(0), a * sech2 / likelihood, T(1));
  const T redescent = select(b > T(0), b / likelihood, T(0));
  return inlier * (sech2 / T(2) - redescent * t * t) * (per_s * per_s);
}

// The share of outliers: in_front in front of the surface, behind behind it unless `behind` is negative.
template <class T>
HD T sided_floor(T residual_m, T in_front, T behind) {
  return select((residual_m < T(0)) & (behind >= T(0)), behind, in_front);
}

// The logistic density of the residual (thesis Eq. 3.11) as a cost, over a constant share of outliers:
//   -log((1 - e) sech^2(r / 2s) + e).
// e = 0 is the printed likelihood: quadratic near 0, linear far away. e > 0 redescends: a far residual costs
// -log e and has no more influence. docs/math/depth_tracker.md, section 2.
template <class T>
struct DepthLogistic {
  T scale_m;
  T outlier_floor;
  Curvature curvature = Curvature::kIrls;
  T floor_behind = T(-1);  // e of measurements behind the surface (residual < 0); negative: outlier_floor

  template <class U>
  HD DepthLogistic<U> cast() const {
    return {U(scale_m), U(outlier_floor), curvature, U(floor_behind)};
  }
  HD T floor_of(T residual_m) const { return sided_floor(residual_m, outlier_floor, floor_behind); }
  // per_noise: scale_m over the measurement's noise.
  HD Curve<T> operator()(T residual_m, T per_noise) const {
    const T e = floor_of(residual_m);
    return logistic_mixture(residual_m, (T(1) / scale_m) * per_noise, T(1) - e, e, curvature);
  }
  HD T second_derivative(T residual_m, T per_noise) const {
    const T e = floor_of(residual_m);
    return logistic_mixture_second(residual_m, (T(1) / scale_m) * per_noise, T(1) - e, e);
  }
};

}  // namespace sdftrack::energies
