// SPDX-License-Identifier: MIT
// The energy terms of a solid's pose and sizes. All have the unknowns of PrimitiveField.
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
  double unit_m = 1;              // lengths of the solid that the printed form scales
  double scale_m = 0.005;         // s of the logistic density of a measurement's residual
  double outlier_floor = 0.1;     // share of measurements that do not belong to the solid
  double outline_scale_px = 0.5;  // the same for the outline, px
  double outline_floor = 0.0;
  double standing_sigma_m = 0.0005;  // sd of the gap between the solid and the plane that it stands on
  double resting_sigma_rad = 0.001;  // sd of the angle between the plane and the part that lies on it
  Rest rest = Rest::kPoint;
  double shrink = 1e-3;   // cost of a length that grows e-fold: unbounded ends stay at the data
  double thin_m = 0;      // a length below this is penalised: no sheet without need
  double far_m = 0;       // a length above this is penalised: no length far beyond the data; 0: off
  bool crowded = false;   // the smallest shape that holds most measurements: a length that grows e-fold costs
                          // a share of them (kCrowd)
  bool lost_rays = true;  // rims without measurements count if the kind has edges (has_edges)
  const float* per_noise = nullptr;  // per point: 1 / relative noise; nullptr: all equal
  bool in_double = false;            // also bare points, one by one: the reference of tests
  int points = 1 << 30;              // the first ones of the view, at most this many
  int rays = 1 << 30;
};

// The sums of a term, and the sums of outer products of single contributions, for the sandwich covariance.
struct PrimitiveSums {
  static constexpr int P = PrimitiveField::P;
  double cost = 0;
  double gradient[P] = {};
  double hessian[P * (P + 1) / 2] = {};

  // n: the number of columns that count.
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

  // A: the Gauss-Newton part of the true second derivative; B: the sum of the squared slopes
  // (docs/math/depth_tracker.md).
  struct Sandwich {
    Eigen::MatrixXd A, B;
  };
  // `inverse` of A: slopes as if each measurement had not been fitted to (if few; in_double), docs eq. 3.
  Sandwich sandwich(const optim::State& x, const Eigen::MatrixXd* inverse = nullptr) const;
  // The cost of the measurements alone.
  double readings_cost(const optim::State& x) const;
  // The clearance (m) of each outline ray that is used.
  std::vector<double> clearances(const optim::State& x) const;
  // The cost of the outline alone, from its clearances.
  double outline_cost(const std::vector<double>& clearances_m) const;
  // Share of the outline rays that hit or miss the solid as they should, to a pixel; 1 if there are none.
  double outline_agreement(const optim::State& x) const;
  // 1 / relative noise of each measurement that is used: at a slant a pixel mixes in what its neighbours see,
  // so its depth is uncertain by a multiple of the slope.
  void slants(const optim::State& x, std::vector<float>* per_noise) const;
  // Residual (m) of each measurement that is used.
  void residuals(const optim::State& x, std::vector<double>* out) const;

 private:
  PrimitiveField field_at(const optim::State& x) const {
    return PrimitiveField::of(kind_, options_.scaling, x, options_.unit_m);
  }
  // Every contribution, or only those that the loops over packs of points do not sum.
  template <class Add>
  void visit(const PrimitiveField& field, const optim::State& x, const Add& add) const;
  template <class Add>
  void visit_points(const PrimitiveField& field, const Add& add) const;
  template <class Add>
  void visit_outline(const PrimitiveField& field, const Add& add) const;
  OutlineCost<double> outline_cost_of(const OutlineRay& ray, double clearance_m) const;
  std::size_t points() const;
  std::size_t rays() const;
  // A patch has its own closed form for rays, in double.
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
