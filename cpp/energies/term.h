// SPDX-License-Identifier: MIT
// The contribution of one pixel or pack of pixels: what the CPU loop and a CUDA kernel share.
#pragma once

#include <type_traits>

#include "energies/field.h"
#include "energies/penalty.h"
#include "energies/penalty_rgbd.h"

namespace sdftrack::energies {

// What a pixel's residual is.
enum class Residual {
  kPoint,   // phi at the measured point (thesis Eq. 3.11)
  kSlope,   // phi over its slope along the ray: a length along the ray, with noise in the slope
  kRayHit,  // depth at which the ray meets the model, minus the measured depth; kSlope where it does not meet
};

constexpr double kGrazingSlope = 0.17;    // d phi / d z along a ray at 80 degrees from the normal
constexpr double kFallbackSlope = 0.3;    // least slope that a fallback pixel is divided by
constexpr double kHitTolerance_m = 5e-4;  // a ray has met the model when |phi| is below this
constexpr double kHitLead_m = 0.003;  // the search starts this far in front of the measurement: from a point
                                      // behind the middle of a thin wall it would run away from the front
constexpr double kHitReach_m = 0.05;  // largest distance of a hit from the measured depth

// Structure of arrays: one entry per pixel of the fixed set. Pixel coordinates are those of the ideal pinhole
// (distortion removed). `gain` is the pixel's class, fixed from one settling to the next: 0 where its ray
// meets the model, else the fallback's 1 / slope. `per_noise` is 1 over the measurement's noise in units of
// the energy's noise. `foreground` is P_f of the pixel's colour, for penalties that use it.
template <class T>
struct PixelsView {
  int count;
  const T *u_px, *v_px, *depth_m, *per_noise;
  T* hit_m;  // where the ray met the model at the last evaluated state
  T* gain;
  const T* foreground = nullptr;
};

// What a pixel adds to the normal equations: cost, and its slope and curvature as functions of phi.
template <class T, int P>
struct Contribution {
  T cost, slope, curvature;
  T J[P];  // d phi / d unknowns
};

// S is float or double; a cost is always summed in double.
template <class S, int P>
struct Sums {
  double cost = 0, count = 0;
  S gradient[P] = {};
  S hessian[P * (P + 1) / 2] = {};  // lower triangle, row by row

  template <class U>
  HD void add(const Contribution<U, P>& c) {
    cost += double(c.cost), count += 1;
    for (int a = 0, k = 0; a < P; ++a) {
      gradient[a] += static_cast<S>(c.slope * c.J[a]);
      const U weighted = c.curvature * c.J[a];
      for (int b = 0; b <= a; ++b) hessian[k++] += static_cast<S>(weighted * c.J[b]);
    }
  }
  HD void operator+=(const Sums& o) {
    cost += o.cost, count += o.count;
    for (int j = 0; j < P; ++j) gradient[j] += o.gradient[j];
    for (int j = 0; j < P * (P + 1) / 2; ++j) hessian[j] += o.hessian[j];
  }
};

struct NoPenalty {
  template <class U>
  HD NoPenalty cast() const {
    return {};
  }
};

// Pixel i and, in a pack, the n - 1 that follow it.
template <class Field, class Penalty>
struct Term {
  static constexpr int P = Field::P;
  using T = typename Field::Scalar;
  using S = ScalarOf<T>;
  using Mask = decltype(T() < T());

  Field field;
  Penalty penalty;
  Intrinsics<T> K;
  PixelsView<S> pixels;
  Residual residual;
  bool reclassify;   // decide again between hit and fallback
  int newton_steps;  // 1: warm start from the last hit; more: from the measurement, until |phi| < 1e-5 m
  T inv_fx = T(1) / K.fx, inv_fy = T(1) / K.fy;

  // This term for lanes of U.
  template <class U>
  HD auto cast() const {
    return Term<decltype(field.template cast<U>()), decltype(penalty.template cast<U>())>{
        field.template cast<U>(),
        penalty.template cast<U>(),
        K.template cast<U>(),
        pixels,
        residual,
        reclassify,
        newton_steps,
        U(inv_fx),
        U(inv_fy)};
  }

  // This term without its penalty, for callers that need residuals and not their costs.
  HD Term<Field, NoPenalty> without_penalty() const {
    return {field, {}, K, pixels, residual, reclassify, newton_steps, inv_fx, inv_fy};
  }

  HD Vec3<T> ray_of(int i, int n = 1) const {
    return {(load<T>(pixels.u_px + i, n) - K.cx) * inv_fx, (load<T>(pixels.v_px + i, n) - K.cy) * inv_fy,
            T(1)};
  }

  static HD Mask every() { return T(0) <= T(0); }

  // The residual of a pixel and d residual / d phi, from the last sample of the field.
  struct Reading {
    T residual_m, gain;
  };

  // A penalty that uses colours takes the pixel's posterior as a third argument.
  static constexpr bool kColor = std::is_invocable_v<const Penalty&, T, T, T>;

  HD Curve<T> curve(int i, int n, T residual_m) const {
    const T per_noise = load<T>(pixels.per_noise + i, n);
    if constexpr (kColor)
      return penalty(residual_m, per_noise, load<T>(pixels.foreground + i, n));
    else
      return penalty(residual_m, per_noise);
  }
  HD T second_derivative(int i, int n, T residual_m) const {
    const T per_noise = load<T>(pixels.per_noise + i, n);
    if constexpr (kColor)
      return penalty.second_derivative(residual_m, per_noise, load<T>(pixels.foreground + i, n));
    else
      return penalty.second_derivative(residual_m, per_noise);
  }

  // phi and its slope along the ray r at depth z, with the full row if kRow.
  template <bool kRow>
  HD T look(Vec3<T> r, T z, FieldRow<T, P>* row) const {
    if constexpr (kRow)
      field.row(z * r, row);
    else
      field.value(z * r, &row->phi_m, &row->grad_cam);
    return dot(row->grad_cam, r);
  }

  // Where `hopes`: Newton's iteration from *z for the depth at which the pixel's ray meets the model.
  // Elsewhere: one evaluation at *z, which stays. Returns 1 over the slope of the last evaluation, limited.
  template <bool kRow>
  HD T find_hit(Vec3<T> r, T depth, Mask hopes, T* z, FieldRow<T, P>* row) const {
    T at = *z, next, per_c;
    for (int k = 1;; ++k) {
      const T slope = look<kRow>(r, at, row);
      per_c = T(1) / select(slope > T(-kGrazingSlope), T(-kGrazingSlope), slope);
      next = at - row->phi_m * per_c;
      if (k >= newton_steps) break;
      const Mask goes_on = hopes & (abs(row->phi_m) >= T(1e-5));
      if (!any(goes_on)) break;
      at = select(goes_on, next, at);
    }
    const T afresh = depth - T(kHitLead_m);  // for a ray that diverged
    *z = select(hopes, select(abs(next - depth) < T(kHitReach_m), next, afresh), *z);
    return per_c;
  }

  HD T hit_start(int i, int n, T depth) const {
    return newton_steps > 1 ? depth - T(kHitLead_m) : load<T>(pixels.hit_m + i, n);
  }

  // One step of the hits alone: brings them near the model before the first linearisation.
  HD void settle(int i, int n) const {
    FieldRow<T, P> row;
    T z = load<T>(pixels.hit_m + i, n);
    const T depth = load<T>(pixels.depth_m + i, n);
    find_hit<false>(ray_of(i, n), depth, every(), &z, &row);
    store(z, pixels.hit_m + i, n);
  }

  // phi at the measured point.
  HD T distance(int i, int n) const {
    T phi;
    Vec3<T> unused;
    field.value(load<T>(pixels.depth_m + i, n) * ray_of(i, n), &phi, &unused);
    return phi;
  }

  // Cost at a state.
  HD T cost(int i, int n = 1) const {
    const T depth = load<T>(pixels.depth_m + i, n), gain = load<T>(pixels.gain + i, n);
    const Mask meets = gain == T(0);
    FieldRow<T, P> row;
    T z = select(meets, hit_start(i, n, depth), depth);
    find_hit<false>(ray_of(i, n), depth, meets, &z, &row);
    store(select(meets, z, load<T>(pixels.hit_m + i, n)), pixels.hit_m + i, n);
    return curve(i, n, select(meets, z - depth, gain * row.phi_m)).cost;
  }

  // Residual, gain and Jacobian row at the current state.
  HD Reading read(int i, int n, FieldRow<T, P>* row) const { return read_along(ray_of(i, n), i, n, row); }

  // As read(), along a ray that the caller has computed.
  HD Reading read_along(Vec3<T> r, int i, int n, FieldRow<T, P>* row) const {
    const T depth = load<T>(pixels.depth_m + i, n);
    T gain = load<T>(pixels.gain + i, n);
    if (residual != Residual::kRayHit) {
      const T slope = look<true>(r, depth, row);
      if (reclassify) gain = residual == Residual::kPoint ? T(1) : fallback_gain(slope);
      if (reclassify) store(gain, pixels.gain + i, n);
      return {gain * row->phi_m, gain};
    }
    const Mask hopes = reclassify ? every() : gain == T(0);
    T z = select(hopes, hit_start(i, n, depth), depth);
    const T per_c = find_hit<true>(r, depth, hopes, &z, row);
    store(select(hopes, z, load<T>(pixels.hit_m + i, n)), pixels.hit_m + i, n);
    Mask meets = hopes;
    if (reclassify) {
      meets = (abs(row->phi_m) < T(kHitTolerance_m)) & (per_c > T(-1 / kGrazingSlope));
      if (!all(meets)) {
        FieldRow<T, P> measured;
        const T slope = look<true>(r, depth, &measured);
        gain = fallback_gain(slope);
        choose(meets, measured, row);
      }
      gain = select(meets, T(0), gain);
      store(gain, pixels.gain + i, n);
    }
    return {select(meets, z - depth, gain * row->phi_m), select(meets, -per_c, gain)};
  }

  // As read(), for pixels whose rays are known not to meet the model.
  HD Reading read_fallback(int i, int n, FieldRow<T, P>* row) const {
    const T gain = load<T>(pixels.gain + i, n);
    look<true>(ray_of(i, n), load<T>(pixels.depth_m + i, n), row);
    return {gain * row->phi_m, gain};
  }

  // Replaces the row by the other one where not `keep`.
  static HD void choose(Mask keep, const FieldRow<T, P>& other, FieldRow<T, P>* row) {
    row->phi_m = select(keep, row->phi_m, other.phi_m);
    for (int j = 0; j < P; ++j) row->J[j] = select(keep, row->J[j], other.J[j]);
  }

  static HD T fallback_gain(T slope) {
    const T a = abs(slope);
    return T(1) / select(a > T(kFallbackSlope), a, T(kFallbackSlope));
  }

  HD Contribution<T, P> linearize(int i, int n = 1) const {
    FieldRow<T, P> row;
    const Reading reading = read(i, n, &row);
    const Curve<T> c = curve(i, n, reading.residual_m);
    return contribution(row, c, reading.gain);
  }

  static HD Contribution<T, P> contribution(const FieldRow<T, P>& row, const Curve<T>& curve, T gain) {
    Contribution<T, P> out{curve.cost, curve.slope * gain, curve.curvature * gain * gain, {}};
    for (int j = 0; j < P; ++j) out.J[j] = row.J[j];
    return out;
  }
};

}  // namespace sdftrack::energies
