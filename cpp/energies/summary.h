// SPDX-License-Identifier: MIT
// Sums over an even subset of the pixels, of which a covariance is made.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <vector>

#include "energies/term.h"

namespace sdftrack {

// What the final state says about itself, from an even subset of the pixels. Sums that a covariance is made
// of, with psi = d cost / d residual, scaled up to all pixels: A = sum psi' J J^T with, for psi', the weight
// psi / residual times the mean psi' over the mean weight (each pixel's own psi' may be negative, and a
// weakly seen direction's sum would vanish by chance); B = sum psi^2 J J^T; rounding = the gradient that the
// interpolant's error makes; missed = the gradient of the pixels whose rays miss the model, all of them; and
// the mean of J J^T (d phi / d unknowns) over the inliers: what the geometry
// can see whatever the noise.
struct EnergySummary {
  Eigen::MatrixXd A, B, geometry;
  Eigen::VectorXd rounding, missed;
  double inliers = 0;  // pixels of the subset with weight above one half
  // Robust sd of residual over noise scale, of the rays that meet the model; 0 where fewer than 20 do.
  double noise_m = 0;
  // With colours: mean cost of the depth penalty alone, each pixel weighed by how far its colour is the
  // object's; and the mean posterior of the pixels on the surface, -1 where there are none.
  double cost = 0, foreground = -1;
};

// By how much the trilinear interpolant lies above the field on average over a cell: h^2 / 12 of the second
// derivatives, which the differences over one voxel h give without dividing.
template <class Field, class T>
T interpolation_error(const Field& field, Vec3<T> p_cam, T voxel_m) {
  T centre, sum = 0;
  Vec3<T> unused;
  field.value(p_cam, &centre, &unused);
  for (int k = 0; k < 6; ++k) {
    const T h = k % 2 ? voxel_m : -voxel_m;
    T value;
    field.value(p_cam + Vec3<T>{k / 2 == 0 ? h : 0, k / 2 == 1 ? h : 0, k / 2 == 2 ? h : 0}, &value, &unused);
    sum += value - centre;
  }
  return sum / T(12);
}

// Lower triangle of a sum of weighted J J^T.
template <int P>
struct OuterSum {
  double lower[P * (P + 1) / 2] = {};

  void add(const float (&J)[P], float weight) {
    int k = 0;
    for (int a = 0; a < P; ++a)
      for (int b = 0; b <= a; ++b) lower[k++] += static_cast<double>(weight * J[a] * J[b]);
  }
  Eigen::MatrixXd matrix(double factor) const {
    Eigen::MatrixXd M(P, P);
    int k = 0;
    for (int a = 0; a < P; ++a)
      for (int b = 0; b <= a; ++b, ++k) M(a, b) = M(b, a) = factor * lower[k];
    return M;
  }
};

template <int P>
class SummarySums {
 public:
  // Returns the pixel's residual.
  template <class Term>
  float add(const Term& term, int i, float voxel_m) {
    FieldRow<float, P> row;
    const auto reading = term.read(i, 1, &row);
    const bool hit = term.pixels.gain[i] == 0.0f;
    const float noise = 1 / term.pixels.per_noise[i], gain2 = reading.gain * reading.gain;
    const float residual = reading.residual_m, s = term.penalty.scale_m * noise;
    const Curve<float> curve = term.curve(i, 1, residual);
    const float slope = curve.slope;
    const float weight =
        Term::kColor ? curve.curvature : (std::abs(residual) > 1e-3f * s ? slope / residual : 0.5f / (s * s));
    Class& of = classes_[!hit ? 0 : (gain2 < kSteepGain * kSteepGain ? 1 : 2)];
    of.curvature += static_cast<double>(term.second_derivative(i, residual));
    of.slope2 += static_cast<double>(slope * slope);
    of.weight += static_cast<double>(weight);
    of.JJ.add(row.J, gain2 * weight);
    if (hit && count_ % kRoundingStride == 0) {
      const float error = interpolation_error(term.field, term.pixels.hit_m[i] * term.ray_of(i), voxel_m);
      const float slope_there = term.second_derivative(i, residual);
      for (int a = 0; a < P; ++a)
        rounding_[a] += static_cast<double>(kRoundingStride * gain2 * slope_there * error * row.J[a]);
    }
    if (weight * 4 * s * s > 1) {  // half of the weight that a residual of 0 has
      geometry_.add(row.J, 1.0f);
      inliers_ += 1;
    }
    ++count_;
    return residual;
  }

  template <class Term>
  void add_miss(const Term& term, int i) {
    FieldRow<float, P> row;
    const auto reading = term.read(i, 1, &row);
    const float pull = reading.gain * term.curve(i, 1, reading.residual_m).slope;
    for (int a = 0; a < P; ++a) missed_[a] += static_cast<double>(pull * row.J[a]);
  }

  EnergySummary summary(int pixels) const {
    EnergySummary out;
    const double scale_up = count_ > 0 ? static_cast<double>(pixels) / count_ : 0;
    out.A = out.B = Eigen::MatrixXd::Zero(P, P);
    for (const Class& c : classes_) {
      if (!(c.weight > 0)) continue;
      const Eigen::MatrixXd JJ = c.JJ.matrix(scale_up / c.weight);
      out.A += std::max(kLeastSlope * c.weight, c.curvature) * JJ;
      out.B += c.slope2 * JJ;
    }
    out.geometry = geometry_.matrix(inliers_ > 0 ? 1 / inliers_ : 0);
    out.rounding = scale_up * Eigen::Map<const Eigen::Matrix<double, P, 1>>(rounding_);
    out.missed = Eigen::Map<const Eigen::Matrix<double, P, 1>>(missed_);
    out.inliers = inliers_;
    return out;
  }

 private:
  static constexpr int kRoundingStride = 4;  // of the pixels, those asked for the interpolant's error
  static constexpr double kLeastSlope = 0.05;
  static constexpr float kSteepGain = 2;  // 60 degrees from the normal

  struct Class {
    OuterSum<P> JJ;
    double curvature = 0, slope2 = 0, weight = 0;
  };
  Class classes_[3];  // fallback, hit, hit at a grazing angle: their residuals have other sizes
  OuterSum<P> geometry_;
  double rounding_[P] = {}, missed_[P] = {};
  double inliers_ = 0;
  int count_ = 0;
};

}  // namespace sdftrack
