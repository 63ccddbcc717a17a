// SPDX-License-Identifier: MIT
#include "calibration/registration/map_residuals.h"

#include <algorithm>
#include <cmath>

#include "calibration/registration/map_fit.h"
#include "optim/dense.h"
#include "optim/lm_loop.h"

namespace sdftrack::calibration {

namespace {

constexpr double kHuber = 2;  // sd of a pair's residual (two coordinates) at which the loss becomes linear
constexpr double kFloor_px = 0.02;    // floor of a colour centre's sd: the sampling error without noise
constexpr double kSmallStep = 1e-13;  // in the unknowns' scales

Eigen::Vector3d to_eigen(Vec3d v) { return {v.x, v.y, v.z}; }

// The system that the optimiser solves.
class MapSystem {
 public:
  MapSystem(const MapResiduals& residuals, const Chosen& chosen, double scale, MapState* x)
      : residuals_(residuals), chosen_(chosen), scale_(scale), x_(x), trial_(*x) {
    here_ = sums(*x);
  }
  double cost() const { return here_.cost; }
  double count() const { return here_.count; }
  bool has_data() const { return here_.count > 0; }
  bool find_step(double damping) {
    Eigen::MatrixXd A = here_.hessian;
    optim::damp(damping, &A);
    step_ = optim::solve_symmetric<Eigen::Dynamic, 1>(A, -here_.gradient);
    return step_.allFinite();
  }
  optim::Promise promised() const {
    const double all = -(here_.gradient.dot(step_) + 0.5 * step_.dot(here_.hessian * step_));
    return {all, all};
  }
  double look() {
    const int n = x_->map.unknowns();
    trial_ = {x_->map.moved(step_.head(n).cwiseProduct(x_->map.scales())),
              x_->offset_s + (step_.size() > n ? step_[n] : 0.0)};
    next_ = sums(trial_);
    return next_.cost;
  }
  void accept(bool) { *x_ = trial_, here_ = next_; }
  bool step_is_small() const { return step_.cwiseAbs().maxCoeff() < kSmallStep; }

 private:
  optim::NormalEquations sums(const MapState& x) const {
    optim::NormalEquations out;
    out.reset(residuals_.unknowns(x.map));
    const std::vector<PairResidual> all = residuals_.at(x);
    for (std::size_t i = 0; i < all.size(); ++i) {
      if (!chosen_[i]) continue;
      if (!all[i].known) {  // a pair outside of the path or the camera costs as much as one that would be
                            // dropped
        out.cost += kHuber * std::sqrt(kDroppedChi2);
        continue;
      }
      const double length = all[i].white.norm() / scale_, weight = std::min(1.0, kHuber / length);
      out.cost += length < kHuber ? 0.5 * length * length : kHuber * (length - 0.5 * kHuber);
      out.hessian += weight / (scale_ * scale_) * all[i].rows.transpose() * all[i].rows;
      out.gradient -= weight / (scale_ * scale_) * all[i].rows.transpose() * all[i].white;
      out.count += 1;
    }
    return out;
  }

  const MapResiduals& residuals_;
  const Chosen& chosen_;
  const double scale_;
  MapState *x_, trial_;
  optim::NormalEquations here_, next_;
  Eigen::VectorXd step_;
};

}  // namespace

Eigen::VectorXd MapResiduals::scales(const DepthToColor& map) const {
  Eigen::VectorXd out = Eigen::VectorXd::Ones(unknowns(map));
  out.head(map.unknowns()) = map.scales();
  return out;
}

PairResidual MapResiduals::of_pair(const BallPair& pair, const MapState& x,
                                   const Eigen::VectorXd& scales) const {
  PairResidual out;
  Vec3d center = pair.center_cam, velocity{0, 0, 0};
  double variance_share = 1;
  if (path_) {
    const std::optional<BallPath::At> at = path_->at(pair.time_s + x.offset_s);
    if (!at) return out;
    center = at->center_cam, velocity = at->velocity, variance_share = at->variance_share;
  }
  const DepthToColor::Pixel mapped = x.map.at(center);
  out.px = {pair.color_px.x - mapped.px.x, pair.color_px.y - mapped.px.y};
  const Eigen::Matrix2d S =
      pair.color_covariance + kFloor_px * kFloor_px * Eigen::Matrix2d::Identity() +
      variance_share * mapped.by_point * pair.center_covariance * mapped.by_point.transpose();
  if (!S.allFinite() || !is_finite(out.px)) return out;
  const int n = x.map.unknowns();
  out.rows.resize(2, unknowns(x.map));
  out.rows.leftCols(n) = mapped.by_map.leftCols(n) * scales.head(n).asDiagonal();
  if (path_) out.rows.col(n) = mapped.by_point * to_eigen(velocity);
  // Whitened by the lower factor of S.
  const double a = std::sqrt(S(0, 0)), b = S(1, 0) / a, c = std::sqrt(S(1, 1) - b * b);
  Eigen::Matrix2d whitening;
  whitening << 1 / a, 0, -b / (a * c), 1 / c;
  out.white = whitening * Eigen::Vector2d(out.px.x, out.px.y);
  out.rows = whitening * out.rows;
  out.known = out.white.allFinite();
  return out;
}

std::vector<PairResidual> MapResiduals::at(const MapState& x) const {
  const Eigen::VectorXd scales = this->scales(x.map);
  std::vector<PairResidual> out;
  out.reserve(pairs_.size());
  for (const BallPair& pair : pairs_) out.push_back(of_pair(pair, x, scales));
  return out;
}

MapState minimum(const MapResiduals& residuals, const MapState& start, const Chosen& chosen, double scale) {
  optim::LmRules rules;
  rules.max_steps = 60, rules.damping_min = 1e-12, rules.damping_max = 1e8, rules.cost_relative = 1e-9;
  MapState x = start;
  MapSystem system(residuals, chosen, scale, &x);
  optim::LmRecord record;
  optim::run_lm(system, rules, &record);
  return x;
}

}  // namespace sdftrack::calibration
