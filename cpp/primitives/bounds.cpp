// SPDX-License-Identifier: MIT
#include "primitives/bounds.h"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "optim/camera_increment.h"
#include "optim/dense.h"

namespace sdftrack::primitives {

namespace {

constexpr double kGrowth = 1.0 / 3;
constexpr double kMinGrowth_m = 0.01;
// Change of an exponent: a half axis of 50 mm moves the surface by at most 4 mm.
constexpr double kExponentChange = 0.25;
constexpr double kRise = 8;  // nats: where a size is known, growth costs at least this much
constexpr int kSteps = 6;
constexpr int kFew = 300;  // up to so many measurements count in the covariance as if not fitted to
// Outline pixels that see the same place of an edge, two on either side, and share the error of its rounding.
// Chosen on 80 superquadrics; other kinds have fewer unknowns, which depth alone determines in most views.
constexpr double kPixelsOfEdge = 4;
constexpr int kPoints = 500, kRays = 400;  // a part suffices to see a rise

optim::State moved(const optim::State& x, Vec3d shift_obj) {
  optim::State out = x;
  out.T_obj_cam[0].t = out.T_obj_cam[0].t - shift_obj;
  return out;
}

// An exponent made larger and smaller, as far as the limits leave half of the change.
std::vector<optim::State> reshaped(const optim::State& x, std::size_t at) {
  const double e = std::exp(x.log_size[at]);
  std::vector<optim::State> out;
  for (const double change : {kExponentChange, -kExponentChange}) {
    const double other = std::clamp(e + change, sdf::kLeastExponent, sdf::kMostExponent);
    if (std::abs(other - e) < 0.5 * kExponentChange) continue;
    out.push_back(x);
    out.back().log_size[at] = std::log(other);
  }
  return out;
}

// States grown along length i: two that keep one end each, and one that keeps the centre.
std::vector<optim::State> grown(PrimitiveKind kind, const optim::State& x, int i) {
  const auto at = std::size_t(i);
  if (!is_length(kind, i)) return reshaped(x, at);
  optim::State bigger = x;
  const double length = std::exp(x.log_size[at]);
  const double more = std::max(kGrowth * length, kMinGrowth_m);
  bigger.log_size[at] = std::log(length + more);
  std::vector<optim::State> out = {bigger};
  if (size_of(kind, i).has_end) {
    const int k = size_of(kind, i).axis;
    const double by = more * facts(kind).axes[std::size_t(k)].half;
    const Vec3d half{k == 0 ? by : 0, k == 1 ? by : 0, k == 2 ? by : 0};
    out.push_back(moved(bigger, half));
    out.push_back(moved(bigger, -half));
  } else {
    // Away from the camera, so that the visible side stays in place.
    Vec3d away = -x.T_obj_cam[0].t;
    if (is_round(kind)) away.z = 0;
    if (norm(away) > 1e-9) out.push_back(moved(bigger, (more / norm(away)) * away));
  }
  if (has_apex(kind)) {
    // A longer side of the same slope: the apex stays.
    optim::State longer = x;
    const double factor = 1 + more / length, height = std::exp(x.log_size[1]);
    for (double& s : longer.log_size) s += std::log(factor);
    out.push_back(moved(longer, {0, 0, -0.5 * (factor - 1) * height}));
  }
  return out;
}

}  // namespace

void find_bounds(const PrimitiveView& view, const PrimitiveEnergyOptions& energy, optim::LmWork* work,
                 PrimitiveFit* fit) {
  PrimitiveEnergyOptions part = energy;
  part.far_m = 0;        // the preset limit is not evidence
  part.crowded = false;  // the end of the points is not evidence of the object's end
  part.points = std::min(energy.points, kPoints), part.rays = std::min(energy.rays, kRays);
  PrimitiveEnergy cost(fit->kind, &view, part);
  const double here = cost.cost(fit->x);
  const auto rays = int(view.outline.size());
  const double rise = kRise * std::min(1.0, double(part.rays) / std::max(1, std::min(rays, energy.rays)));
  optim::LmOptions lm;
  lm.max_steps = kSteps, lm.cost_gain = 0.5;
  for (int i = 0; i < size_count(fit->kind); ++i) {
    optim::State best;
    double least = std::numeric_limits<double>::infinity();
    for (const optim::State& x : grown(fit->kind, fit->x, i)) {
      const double c = cost.cost(x);
      if (c < least) least = c, best = x;
    }
    if (least - here > rise) {
      lm.fixed.assign(cost.unknowns().size(), false);
      lm.fixed[6 + i] = true;
      optim::LmResult result;
      result.x = best;
      optim::minimize(cost, lm, work, &result);
      least = result.cost;
    }
    fit->bounded[i] = least - here > rise;
  }
}

Eigen::MatrixXd fit_covariance(const PrimitiveView& view, const PrimitiveEnergyOptions& energy,
                               const PrimitiveFit& fit, double diameter_m) {
  const bool few = fit.freedom + free_count(fit.kind) <= kFew;
  PrimitiveEnergyOptions each = energy;
  each.in_double = energy.in_double || few;
  const PrimitiveEnergy cost(fit.kind, &view, each);
  const Eigen::Index n = cost.unknowns().size();
  Eigen::VectorXd prior(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const double sd = i < 3 ? diameter_m : (i < 6 ? 3.14159265358979 : 2.0);
    prior[i] = 1 / (sd * sd);
  }
  // Residuals are smaller than the noise, because the unknowns were fitted to them, and their spread is
  // itself an estimate: Student's variance (docs/math/primitives.md, eq. 3). If infinite, the prior remains.
  const int known_freedom = fit.freedom - kFreedomWithoutMean;
  if (known_freedom <= 0) return prior.cwiseInverse().asDiagonal();
  PrimitiveEnergy::Sandwich at = cost.sandwich(fit.x);
  at.A.diagonal() += prior;
  const Eigen::MatrixXd inverse = optim::inverse_symmetric<Eigen::Dynamic>(at.A);
  if (few) at.B = cost.sandwich(fit.x, &inverse).B;
  if (fit.kind == PrimitiveKind::kSuperquadric) {
    each.rays = 0;
    const PrimitiveEnergy inner(fit.kind, &view, each);
    at.B += (kPixelsOfEdge - 1) * (at.B - inner.sandwich(fit.x, few ? &inverse : nullptr).B);
  }
  at.B.diagonal() += prior;
  const double share = few ? double(fit.freedom) / known_freedom : 1.0;
  return share * inverse * at.B * inverse.transpose();
}

Eigen::MatrixXd camera_covariance(const PrimitiveFit& fit) {
  const int n = size_count(fit.kind);
  Eigen::MatrixXd J = Eigen::MatrixXd::Zero(6 + n, 6 + n);
  J.topLeftCorner<6, 6>() = optim::camera_by_increment(inverse(fit.x.T_obj_cam[0]), Vec3d{0, 0, 0});
  const PrimitiveSize size = fit.size();
  for (int i = 0; i < n; ++i) J(6 + i, 6 + i) = size[i];
  return J * fit.covariance * J.transpose();
}

}  // namespace sdftrack::primitives
