// SPDX-License-Identifier: MIT
// Penalties that weigh a pixel's residual by its colour: P_f, the posterior that the colour is the object's.
#pragma once

#include "energies/penalty.h"

namespace sdftrack::energies {

enum class ColorLikelihood {
  kOdds,     // the colour sets each pixel's share of outliers
  kPrinted,  // P_f d_on + P_b H_out (thesis Eq. 4.12, 4.13, 4.18)
};

// Odds against the object above which a colour counts; it counts in full from 4 times these odds.
constexpr double kClearOdds = 16;

// The depth penalty with each pixel's own share of outliers. A measurement belongs to the object with the
// prior probability 1 - e and to something else with e. Its colour c multiplies the odds of the latter by
//   q = p(c | b) / p(c | f) = (P_b / (1 - prior)) / (P_f / prior),
// limited to h = max(1, min(q, (q / kClearOdds)^3)):
//   -log((1 - e_i) sech^2(r / 2s) + e_i),   e_i / (1 - e_i) = e / (1 - e) h.
// A colour can only lower a pixel's weight, and only where its odds are clear: pixels of the object whose
// colour also occurs around it keep their weight. Otherwise the penalty equals DepthLogistic.
// docs/math/color.md, section 4.
template <class T>
struct ColorOdds {
  T scale_m;
  T outlier_floor;
  T prior;
  Curvature curvature = Curvature::kIrls;
  T floor_behind = T(-1);  // as in DepthLogistic

  template <class U>
  HD ColorOdds<U> cast() const {
    return {U(scale_m), U(outlier_floor), U(prior), curvature, U(floor_behind)};
  }

  HD void shares(T residual_m, T foreground, T* object, T* outliers) const {
    const T e = sided_floor(residual_m, outlier_floor, floor_behind);
    const T q = (T(1) - foreground) * prior / ((T(1) - prior) * foreground);
    const T clear = q * T(1 / kClearOdds), cube = clear * clear * clear;
    const T heard = select(clear > T(1), select(cube < q, cube, q), T(1));
    const T a = T(1) - e, b = e * heard;
    const T per_sum = T(1) / (a + b);
    *object = a * per_sum, *outliers = b * per_sum;
  }

  HD Curve<T> operator()(T residual_m, T per_noise, T foreground) const {
    T object, outliers;
    shares(residual_m, foreground, &object, &outliers);
    return logistic_mixture(residual_m, (T(1) / scale_m) * per_noise, object, outliers, curvature);
  }
  HD T second_derivative(T residual_m, T per_noise, T foreground) const {
    T object, outliers;
    shares(residual_m, foreground, &object, &outliers);
    return logistic_mixture_second(residual_m, (T(1) / scale_m) * per_noise, object, outliers);
  }
};

constexpr double kPosteriorFloor = 1e-3;  // keeps the logarithm away from 0

// L = P_f d_on + P_b H_out, d_on = sech^2(r / 2s), H_out = 1 - d_on in front of the surface (r >= 0), 0
// behind it: the source's form, with P_f and P_b the posteriors. The curvature is that of the responsibility
// P_f d_on / L only; the outside term acts through the slope.
template <class T>
struct ColorPrinted {
  T scale_m;

  template <class U>
  HD ColorPrinted<U> cast() const {
    return {U(scale_m)};
  }

  HD Curve<T> operator()(T residual_m, T per_noise, T foreground) const {
    const T per_s = (T(1) / scale_m) * per_noise;
    const T u = T(0.5) * abs(residual_m) * per_s;
    const T d = exp_negative(T(-2) * u), per_up = T(1) / (T(1) + d);
    const T on = T(4) * d * per_up * per_up, tanh_u = (T(1) - d) * per_up;
    const T outside = select(residual_m >= T(0), T(1) - foreground, T(0));
    const T likelihood = foreground * on + outside * (T(1) - on) + T(kPosteriorFloor);
    const T slope = (foreground - outside) * on / likelihood * tanh_u * per_s;
    const T responsibility = foreground * on / likelihood;
    const T weight = select(u < T(1e-3), T(0.5) * per_s * per_s, tanh_u * per_s / abs(residual_m));
    return {-log_positive(likelihood), copysign(T(1), residual_m) * slope, responsibility * weight};
  }
  HD T second_derivative(T residual_m, T per_noise, T foreground) const {
    const T per_s = (T(1) / scale_m) * per_noise;
    const T t = fast_tanh(T(0.5) * residual_m * per_s), on = T(1) - t * t;
    const T outside = select(residual_m >= T(0), T(1) - foreground, T(0));
    const T likelihood = foreground * on + outside * (T(1) - on) + T(kPosteriorFloor);
    const T slope = (foreground - outside) * on * t * per_s / likelihood;
    // d on / d r = -on t / s, d t / d r = on / 2 s.
    const T numerator = (foreground - outside) * on * (on / T(2) - t * t) * per_s * per_s / likelihood;
    return numerator + slope * slope;
  }
};

}  // namespace sdftrack::energies
