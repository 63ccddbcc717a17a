// SPDX-License-Identifier: MIT
// One pixel's contribution: the only code that the CPU loop and a CUDA kernel share and need.
#pragma once

#include <type_traits>

#include "energies/field.h"
#include "energies/penalty.h"
#include "energies/penalty_rgbd.h"

namespace sdftrack {

// What a pixel's residual is.
enum class Residual {
  kPoint,   // phi at the measured point (thesis Eq. 3.11)
  kSlope,   // the same over its slope along the ray: a length along the ray, with noise in the slope
  kRayHit,  // depth at which the ray meets the model, minus the measured depth; kSlope where it does not meet
};

constexpr double kGrazingSlope = 0.17;    // d phi / d z along a ray at 80 degrees from the normal
constexpr double kFallbackSlope = 0.3;    // least slope that a fallback pixel is divided by
constexpr double kHitTolerance_m = 5e-4;  // a ray has met the model when |phi| is below
constexpr double kHitLead_m = 0.003;  // the search starts this far in front of the reading: a reading behind
                                      // the middle of a thin wall would run away from the wall's front
constexpr double kHitReach_m = 0.05;  // a hit is looked for this far from the measured depth

// Structure of arrays: one entry per pixel of the fixed set. Pixel coordinates are those of the ideal pinhole
// (distortion removed). `gain` is the pixel's class, fixed from one linearisation to the next: 0, its ray
// meets the model; else the fallback's 1 / slope. `foreground` is P_f of the pixel's colour, for penalties
// that ask for it.
template <class T>
struct PixelsView {
  int count;
  const T *u_px, *v_px, *depth_m, *noise_scale;
  T* hit_m;        // accepted hits
  T* trial_hit_m;  // hits of the last trial
  T* gain;
  const T* foreground = nullptr;
};

// S is float within a block of pixels and double beyond (reduce_cpu.h); a cost is always summed in double.
template <class S, int P>
struct Sums {
  double cost = 0, count = 0;
  S gradient[P] = {};
  S hessian[P * (P + 1) / 2] = {};  // lower triangle, row by row

  template <class U>
  HD void operator+=(const Sums<U, P>& o) {
    cost += o.cost, count += o.count;
    for (int j = 0; j < P; ++j) gradient[j] += o.gradient[j];
    for (int j = 0; j < P * (P + 1) / 2; ++j) hessian[j] += o.hessian[j];
  }
};

template <class Field, class Penalty>
struct Term {
  static constexpr int P = Field::P;
  using T = typename Field::Scalar;

  Field field;
  Penalty penalty;
  Intrinsics<T> K;
  PixelsView<T> pixels;
  Residual residual;
  bool reclassify;   // linearisation may move a pixel between hit and fallback
  int newton_steps;  // 1: warm start from the last hit; more: from the reading, until |phi| < 1e-5 m
  T inv_fx = T(1) / K.fx, inv_fy = T(1) / K.fy;

  HD Vec3<T> ray_of(int i) const {
    return {(pixels.u_px[i] - K.cx) * inv_fx, (pixels.v_px[i] - K.cy) * inv_fy, T(1)};
  }

  // The residual of pixel i and d residual / d phi, from the last sample of the field.
  struct Reading {
    T residual_m, gain;
  };

  // A penalty that looks at colours takes the pixel's posterior as a third argument.
  static constexpr bool kColor = std::is_invocable_v<const Penalty&, T, T, T>;

  HD Curve<T> curve(int i, T residual_m) const {
    if constexpr (kColor)
      return penalty(residual_m, pixels.noise_scale[i], pixels.foreground[i]);
    else
      return penalty(residual_m, pixels.noise_scale[i]);
  }
  HD T second_derivative(int i, T residual_m) const {
    if constexpr (kColor)
      return penalty.second_derivative(residual_m, pixels.noise_scale[i], pixels.foreground[i]);
    else
      return penalty.second_derivative(residual_m, pixels.noise_scale[i]);
  }

  // phi and its slope along the ray r at depth z; with the full row where kRow.
  template <bool kRow>
  HD void look(Vec3<T> r, T z, FieldRow<T, P>* row, T* slope) const {
    if constexpr (kRow)
      field.row(z * r, row);
    else
      field.value(z * r, &row->phi_m, &row->grad_cam);
    *slope = dot(row->grad_cam, r);
  }

  // Newton's iteration for the depth at which the ray meets the model; returns the (limited) slope there.
  template <bool kRow>
  HD T find_hit(int i, Vec3<T> r, T* z, FieldRow<T, P>* row) const {
    T c;
    int k = 0;
    do {
      look<kRow>(r, *z, row, &c);
      c = c > T(-kGrazingSlope) ? T(-kGrazingSlope) : c;
      *z -= row->phi_m / c;
    } while (++k < newton_steps && std::abs(row->phi_m) >= T(1e-5));
    const T depth = pixels.depth_m[i];
    if (!(std::abs(*z - depth) < T(kHitReach_m))) *z = depth - T(kHitLead_m);  // lost its way: start afresh
    return c;
  }

  HD T hit_start(int i) const {
    return newton_steps > 1 ? pixels.depth_m[i] - T(kHitLead_m) : pixels.hit_m[i];
  }

  // One step of the hits alone: brings them near the model before the first linearisation.
  HD void settle(int i) const {
    FieldRow<T, P> row;
    find_hit<false>(i, ray_of(i), &pixels.hit_m[i], &row);
  }

  // Cost of one pixel at a trial state; the trial's hit goes into its own buffer.
  HD T cost(int i) const {
    const Vec3<T> r = ray_of(i);
    const T depth = pixels.depth_m[i];
    FieldRow<T, P> row;
    T res, slope;
    if (pixels.gain[i] == T(0)) {
      T z = hit_start(i);
      find_hit<false>(i, r, &z, &row);
      pixels.trial_hit_m[i] = z;
      res = z - depth;
    } else {
      look<false>(r, depth, &row, &slope);
      res = pixels.gain[i] * row.phi_m;
      pixels.trial_hit_m[i] = pixels.hit_m[i];
    }
    return curve(i, res).cost;
  }

  // Residual, gain and Jacobian row of pixel i at the current state.
  HD Reading read(int i, FieldRow<T, P>* row) const {
    const Vec3<T> r = ray_of(i);
    const T depth = pixels.depth_m[i];
    if (residual == Residual::kRayHit && (reclassify || pixels.gain[i] == T(0))) {
      T z = hit_start(i);
      const T c = find_hit<true>(i, r, &z, row);
      pixels.hit_m[i] = z;
      const bool meets = std::abs(row->phi_m) < T(kHitTolerance_m) && c < T(-kGrazingSlope);
      if (reclassify) pixels.gain[i] = meets ? T(0) : T(1);
      if (pixels.gain[i] == T(0)) return {z - depth, T(-1) / c};
    }
    T slope;
    look<true>(r, depth, row, &slope);
    if (reclassify) pixels.gain[i] = residual == Residual::kPoint ? T(1) : fallback_gain(slope);
    return {pixels.gain[i] * row->phi_m, pixels.gain[i]};
  }

  static HD T fallback_gain(T slope) {
    const T a = std::abs(slope);
    return T(1) / (a > T(kFallbackSlope) ? a : T(kFallbackSlope));
  }

  template <class S>
  HD void linearize(int i, Sums<S, P>* sums) const {
    FieldRow<T, P> row;
    const Reading reading = read(i, &row);
    add_row(row, curve(i, reading.residual_m), reading.gain, sums);
  }

  template <class S>
  static HD void add_row(const FieldRow<T, P>& row, const Curve<T>& curve, T gain, Sums<S, P>* sums) {
    sums->cost += static_cast<double>(curve.cost);
    sums->count += 1;
    const T slope = curve.slope * gain, curvature = curve.curvature * gain * gain;
    int k = 0;
    for (int a = 0; a < P; ++a) {
      sums->gradient[a] += static_cast<S>(slope * row.J[a]);
      const T weighted = curvature * row.J[a];
      for (int b = 0; b <= a; ++b) sums->hessian[k++] += static_cast<S>(weighted * row.J[b]);
    }
  }
};

}  // namespace sdftrack
