// SPDX-License-Identifier: MIT
#include "primitives/energies.h"

#include <algorithm>
#include <cmath>

#include "energies/penalty.h"
#include "primitives/packed_terms.h"
#include "primitives/residuals.h"
#include "primitives/solids.h"

namespace sdftrack::primitives {

namespace {

constexpr int P = PrimitiveField::P;
constexpr double kSlanted = 0.35;  // cosine of 70 degrees
constexpr double kMinSay = 0.1;
// Most pixels without a measurement at a receding rim show the object; but next to a depth step half of the
// background's measurements are lost too.
constexpr double kLostBeside = 0.65;
// Nats per measurement. 1 would be the density of an even cloud of points, where all become outliers; at 0.1
// the rim stops 0.6 s inside the cloud's, and a haze of 4 % of its density stays out.
constexpr double kCrowd = 0.1, kCrowdedSolid = 0.02;
constexpr double kMaxLeverage = 0.9;  // of one measurement: more is rounding
// Twice the nats that a size e times beyond its limit costs; a common error would gain hundreds.
constexpr double kFar = 2e4;
constexpr double kThin = 8;  // twice the nats that a length e times below its limit costs

double with_slack(const OutlineRay& ray, double clearance_m) {
  return ray.sight == Sight::kBeside ? clearance_m + ray.slack_m : clearance_m;
}

FloatSolid float_solid(const PrimitiveField& field, Vec3d origin) {
  const Rigidd& T = field.T_obj_cam;
  const auto f = [](double v) { return float(v); };
  return {
      {T.R.r0.cast<float>(), T.R.r1.cast<float>(), T.R.r2.cast<float>()},
      (T * origin).cast<float>(),
      {f(field.size_m[0]), f(field.size_m[1]), f(field.size_m[2]), f(field.size_m[3]), f(field.size_m[4])}};
}

}  // namespace

std::size_t PrimitiveEnergy::points() const {
  return std::min(view_->points.size(), std::size_t(options_.points));
}

std::size_t PrimitiveEnergy::rays() const {
  return std::min(view_->outline.size(), std::size_t(options_.rays));
}

ReadingTerm PrimitiveEnergy::term(const PrimitiveField& field) const {
  return reading_term(view_->packed, view_->along_rays, options_.per_noise, points(),
                      float_solid(field, view_->packed.origin), 1 / options_.scale_m, options_.outlier_floor);
}

OutlineTerm PrimitiveEnergy::outline_term(const PrimitiveField& field) const {
  return primitives::outline_term(view_->packed_outline, rays(), float_solid(field, {0, 0, 0}),
                                  options_.outline_scale_px, options_.outline_floor, kLostBeside,
                                  options_.lost_rays && !has_edges(kind_));
}

void PrimitiveEnergy::add_packs(const PrimitiveField& field, Weighing weighing, PrimitiveSums* sums) const {
  ReadingSums packs;
  const ReadingOps& ops = for_isa<ReadingOps>(used_isa());
  const int k = int(kind_);
  ops.linearize[k](term(field), weighing, &packs);
  ops.linearize_outline[k](outline_term(field), weighing, &packs);
  sums->cost += packs.cost;
  for (int a = 0; a < P; ++a) sums->gradient[a] += packs.gradient[a];
  for (int n = 0; n < P * (P + 1) / 2; ++n) sums->hessian[n] += packs.hessian[n];
}

OutlineCost<double> PrimitiveEnergy::outline_cost_of(const OutlineRay& ray, double clearance_m) const {
  const double floor = ray.sight == Sight::kLost ? kLostBeside : options_.outline_floor;
  return primitives::outline_cost(clearance_m, options_.outline_scale_px * ray.pixel_m, floor,
                                  ray.sight == Sight::kBeside ? -1.0 : 1.0);
}

// add(curve, second derivative, J, mean squared slope) for every contribution; the last is negative for a
// measurement, known otherwise.
template <class Add>
void PrimitiveEnergy::visit_points(const PrimitiveField& field, const Add& add) const {
  const double per_s = 1 / options_.scale_m, e = options_.outlier_floor;
  SolidResidual r;
  for (std::size_t i = 0; i < points(); ++i) {
    if (view_->along_rays)
      ray_residual(field, view_->points[i], &r);
    else
      point_residual(field, view_->points[i], &r);
    const double per_noise = options_.per_noise ? per_s * double(options_.per_noise[i]) : per_s;
    add(
        energies::logistic_mixture(r.m, per_noise, 1 - e, e, energies::Curvature::kIrls),
        [&] { return energies::logistic_mixture_second(r.m, per_noise, 1 - e, e); }, r.J, -1.0);
  }
}

template <class Add>
void PrimitiveEnergy::visit_outline(const PrimitiveField& field, const Add& add) const {
  const PrimitiveEnergyOptions& o = options_;
  const bool lost = o.lost_rays && !has_edges(kind_);
  SolidResidual r;
  for (std::size_t i = 0; i < rays(); ++i) {
    const OutlineRay& ray = view_->outline[i];
    if (ray.sight == Sight::kLost && !lost) continue;
    clearance(field, ray, &r);
    const OutlineCost<double> c = outline_cost_of(ray, with_slack(ray, r.m));
    add(
        c.curve, [&] { return c.second; }, r.J, -1.0);
  }
}

template <class Add>
void PrimitiveEnergy::visit(const PrimitiveField& field, const optim::State& x, const Add& add) const {
  const PrimitiveEnergyOptions& o = options_;
  SolidResidual r;
  if (!in_packs()) visit_points(field, add), visit_outline(field, add);
  if (view_->has_plane) {
    const PrimitiveSize size = std::to_array(field.size_m);
    const auto pull = [&](const SolidResidual& off, double sigma) {
      const double w = 1 / (sigma * sigma);
      add(
          energies::Curve<double>{0.5 * w * off.m * off.m, w * off.m, w}, [&] { return w; }, off.J, w);
    };
    if (o.rest != Rest::kPoint) {
      SolidResidual off[3];
      const int n = resting_residuals(field, size, view_->plane, o.rest, off);
      for (int i = 0; i < n; ++i) pull(off[i], i == 0 ? o.standing_sigma_m : o.resting_sigma_rad);
    } else if (standing_residual(field, size, view_->plane, &r);
               (view_->stands && may_stand(field, view_->plane)) || r.m < 0) {
      pull(r, o.standing_sigma_m);
    }
  }
  for (int i = 0; i < size_count(kind_); ++i) {
    double J[P] = {};
    J[6 + i] = 1;
    const double log_size = x.log_size[i];
    if (!is_length(kind_, i)) {
      const double least = std::log(sdf::kLeastExponent), most = std::log(sdf::kMostExponent);
      const double beyond = std::min(0.0, log_size - least) + std::max(0.0, log_size - most);
      add(
          energies::Curve<double>{0.5 * kFar * beyond * beyond, kFar * beyond, beyond != 0 ? kFar : 0},
          [] { return 0.0; }, J, 0.0);
      continue;
    }
    const double thin = o.thin_m > 0 ? std::min(0.0, log_size - std::log(o.thin_m)) : 0.0;
    const double far = o.far_m > 0 ? std::max(0.0, log_size - std::log(o.far_m)) : 0.0;
    const bool open = o.crowded && size_of(kind_, i).has_end && !has_apex(kind_);
    const double crowd = has_inside(kind_) ? kCrowdedSolid : kCrowd;
    const double spread = open ? crowd * double(points()) : 0.0;
    const double pull = o.shrink + spread;
    // The pull is linear; a curvature of the same size keeps a step below an e-fold.
    add(
        energies::Curve<double>{pull * log_size + 0.5 * kThin * thin * thin + 0.5 * kFar * far * far,
                                pull + kThin * thin + kFar * far,
                                spread + (thin < 0 ? kThin : 0) + (far > 0 ? kFar : 0)},
        [] { return 0.0; }, J, 0.0);
  }
}

void PrimitiveEnergy::linearize(const optim::State& x, optim::NormalEquations* out) {
  const PrimitiveField field = field_at(x);
  PrimitiveSums sums;
  const int n = unknowns().size();
  if (in_packs()) add_packs(field, Weighing::kSolve, &sums), out->count += double(points() + rays());
  visit(field, x, [&](const energies::Curve<double>& c, const auto&, const double(&J)[P], double) {
    sums.add(c.cost, c.slope, c.curvature, J, n);
    out->count += 1;
  });
  sums.add_to(n, out);
}

double PrimitiveEnergy::cost(const optim::State& x) {
  const PrimitiveField field = field_at(x);
  double cost = 0;
  if (in_packs())
    cost += readings_cost(x) + for_isa<ReadingOps>(used_isa()).outline_cost[int(kind_)](outline_term(field));
  visit(field, x,
        [&](const energies::Curve<double>& c, const auto&, const double(&)[P], double) { cost += c.cost; });
  return cost;
}

double PrimitiveEnergy::readings_cost(const optim::State& x) const {
  const PrimitiveField field = field_at(x);
  if (in_packs()) return for_isa<ReadingOps>(used_isa()).cost[int(kind_)](term(field));
  double cost = 0;
  visit_points(field, [&](const energies::Curve<double>& c, const auto&, const double(&)[P], double) {
    cost += c.cost;
  });
  return cost;
}

PrimitiveEnergy::Sandwich PrimitiveEnergy::sandwich(const optim::State& x,
                                                    const Eigen::MatrixXd* inverse) const {
  const PrimitiveField field = field_at(x);
  PrimitiveSums A, B;
  const int n = unknowns().size();
  if (in_packs()) add_packs(field, Weighing::kSecond, &A), add_packs(field, Weighing::kSquare, &B);
  visit(field, x,
        [&](const energies::Curve<double>& c, const auto& second, const double(&J)[P], double spread) {
          const double curvature = second();
          A.add(0, 0, curvature, J, n);
          double square = spread < 0 ? c.slope * c.slope : spread;
          if (inverse && spread < 0) {
            const Eigen::Map<const Eigen::VectorXd> j(J, n);
            const double leverage = std::clamp(curvature * j.dot(*inverse * j), 0.0, kMaxLeverage);
            square /= (1 - leverage) * (1 - leverage);
          }
          B.add(0, 0, square, J, n);
        });
  optim::NormalEquations a, b;
  a.reset(n), b.reset(n);
  A.add_to(n, &a), B.add_to(n, &b);
  return {a.hessian, b.hessian};
}

std::vector<double> PrimitiveEnergy::clearances(const optim::State& x) const {
  const PrimitiveField field = field_at(x);
  std::vector<double> out(rays());
  if (in_packs()) {
    std::vector<float> m(out.size());
    for_isa<ReadingOps>(used_isa()).clearances[int(kind_)](outline_term(field), m.data());
    out.assign(m.begin(), m.end());
    return out;
  }
  SolidResidual r;
  for (std::size_t i = 0; i < out.size(); ++i) {
    clearance(field, view_->outline[i], &r);
    out[i] = with_slack(view_->outline[i], r.m);
  }
  return out;
}

double PrimitiveEnergy::outline_cost(const std::vector<double>& clearances_m) const {
  double cost = 0;
  for (std::size_t i = 0; i < clearances_m.size(); ++i)
    if (view_->outline[i].sight != Sight::kLost)
      cost += outline_cost_of(view_->outline[i], clearances_m[i]).curve.cost;
  return cost;
}

double PrimitiveEnergy::outline_agreement(const optim::State& x) const {
  const std::vector<double> d = clearances(x);
  double agree = 0, all = 0;
  for (std::size_t i = 0; i < d.size(); ++i) {
    const OutlineRay& ray = view_->outline[i];
    if (ray.sight == Sight::kLost) continue;
    all += 1, agree += ray.sight == Sight::kOn ? d[i] < ray.pixel_m : d[i] > -ray.pixel_m;
  }
  return all > 0 ? agree / all : 1.0;
}

void PrimitiveEnergy::slants(const optim::State& x, std::vector<float>* per_noise) const {
  const PrimitiveField field = PrimitiveField::of(kind_, Scaling::kExact, x);
  per_noise->assign(std::min(view_->points.size(), std::size_t(options_.points)), 1.0f);
  if (!view_->along_rays) return;
  for (std::size_t i = 0; i < per_noise->size(); ++i) {
    const Vec3d& p = view_->points[i];
    double phi;
    Vec3d grad;
    field.value(p, &phi, &grad);
    const double cosine = std::abs(dot(grad, p)) / norm(p);
    (*per_noise)[i] = float(std::clamp(cosine / kSlanted, kMinSay, 1.0));
  }
}

void PrimitiveEnergy::residuals(const optim::State& x, std::vector<double>* out) const {
  const PrimitiveField field = field_at(x);
  out->clear();
  if (in_packs()) {
    std::vector<float> phi(points());
    for_isa<ReadingOps>(used_isa()).residuals[int(kind_)](term(field), phi.data());
    out->assign(phi.begin(), phi.end());
    return;
  }
  SolidResidual r;
  for (std::size_t i = 0; i < points(); ++i) {
    if (view_->along_rays)
      ray_residual(field, view_->points[i], &r);
    else
      point_residual(field, view_->points[i], &r);
    out->push_back(r.m);
  }
}

}  // namespace sdftrack::primitives
