// SPDX-License-Identifier: MIT
// What a pose and lengths of a solid cost. Unknowns of all of them: those of PrimitiveField.
#pragma once

#include "optim/energy.h"
#include "primitives/field.h"
#include "primitives/outline_curve.h"
#include "primitives/reading_ops.h"
#include "primitives/standing.h"
#include "primitives/view.h"

namespace sdftrack::primitives {

struct PrimitiveEnergyOptions {
  Scaling scaling = Scaling::kExact;
  double scale_m = 0.005;         // s of the logistic density of a reading's residual
  double outlier_floor = 0.1;     // share of readings that are not the solid's
  double outline_scale_px = 0.5;  // the same of the edge of the picture
  double outline_floor = 0.0;
  double standing_sigma_m = 0.0005;  // of the gap between the solid and the plane that it stands on
  double resting_sigma_rad = 0.001;  // of the turn between what of it lies on the plane and the plane
  Rest rest = Rest::kPoint;
  double shrink = 1e-3;  // cost of a length that grows e-fold: ends that nothing bounds stay at the data
  double thin_m = 0;     // a length below this costs: nothing is a sheet, if it need not be
  double far_m = 0;      // so does one above this: no length far beyond what is seen; 0: none
  bool crowded = false;  // the least shape that holds the crowd of readings: a length that grows e-fold costs
                         // a share of them (kCrowd)
  bool lost_rays = true;             // rims without readings count where the kind has such rims (has_edges)
  const float* per_noise = nullptr;  // of every point: 1 over how much noisier it is; nullptr: all are alike
  bool in_double = false;            // bare points too, one by one: what tests compare with
  int points = 1 << 30;              // at most; the first part of the view's
  int rays = 1 << 30;
};

// Sums of a term, and of the outer products of single contributions, for the sandwich covariance.
struct PrimitiveSums {
  static constexpr int P = PrimitiveField::P;
  double cost = 0;
  double gradient[P] = {};
  double hessian[P * (P + 1) / 2] = {};

  // n: how many of the columns count.
  void add(double value, double slope, double curvature, const double (&J)[P], int n);
  void add_to(int n, optim::NormalEquations* out) const;
};

class PrimitiveEnergy : public optim::Energy {
 public:
  PrimitiveEnergy(PrimitiveKind kind, const PrimitiveView* view, const PrimitiveEnergyOptions& options)
      : kind_(kind), view_(view), options_(options) {}
  optim::Unknowns unknowns() const override { return {1, false, false, size_count(kind_)}; }
  void linearize(const optim::State& x, optim::NormalEquations* out) override;
  double cost(const optim::State& x) override;

  // A: the true second derivative's Gauss-Newton part; B: sum of the squared slopes
  // (docs/math/depth_tracker.md).
  struct Sandwich {
    Eigen::MatrixXd A, B;
  };
  // `inverse` of A: slopes as if each had not been fitted to (of few readings; in_double), docs eq. 3.
  Sandwich sandwich(const optim::State& x, const Eigen::MatrixXd* inverse = nullptr) const;
  // Of the readings alone.
  double readings_cost(const optim::State& x) const;
  // The clearance (m) of each ray of the edge of the picture that is used.
  std::vector<double> clearances(const optim::State& x) const;
  // Of that edge alone, with the clearances at hand.
  double outline_cost(const std::vector<double>& clearances_m) const;
  // Share of its rays that hit or miss the solid as they should, to a pixel; 1 without any.
  double outline_agreement(const optim::State& x) const;
  // Of each reading that is used how much less it says than one that is met squarely: a reading at a slant
  // takes over what its neighbours see, so its depth is in doubt by a multiple of the slope.
  void slants(const optim::State& x, std::vector<float>* per_noise) const;
  // Residual (m) of each reading that is used.
  void residuals(const optim::State& x, std::vector<double>* out) const;

 private:
  // Every contribution; or those that no loop over packs of points sums up.
  template <class Add>
  void visit(const PrimitiveField& field, const optim::State& x, const Add& add) const;
  template <class Add>
  void visit_points(const PrimitiveField& field, const Add& add) const;
  template <class Add>
  void visit_outline(const PrimitiveField& field, const Add& add) const;
  OutlineCost<double> outline_cost_of(const OutlineRay& ray, double clearance_m) const;
  std::size_t points() const;
  std::size_t rays() const;
  // A patch meets rays in a closed form of its own, which is in double.
  bool in_packs() const {
    return !view_->packed.x_m.empty() && options_.scaling == Scaling::kExact && !options_.in_double &&
           (!view_->along_rays || has_inside(kind_));
  }
  ReadingTerm term(const PrimitiveField& field) const;
  OutlineTerm outline_term(const PrimitiveField& field) const;
  void add_packs(const PrimitiveField& field, Weighing weighing, PrimitiveSums* sums) const;

  PrimitiveKind kind_;
  const PrimitiveView* view_;
  PrimitiveEnergyOptions options_;
};

}  // namespace sdftrack::primitives
