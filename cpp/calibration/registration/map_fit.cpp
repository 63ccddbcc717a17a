// SPDX-License-Identifier: MIT
#include "calibration/registration/map_fit.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "base/portable_math.h"
#include "calibration/ball/median.h"
#include "optim/dense.h"

namespace sdftrack::calibration {

namespace {

constexpr double kMaxOff_px = 25;       // limit for a right pair: a colour image 40 ms late, at 1 m/s
constexpr double kMedianChi2 = 1.3863;  // with two degrees of freedom
constexpr int kRounds = 12;
// The weight of the centres' stated noise, as a number of measured coordinates: a dozen pairs with eleven
// unknowns could otherwise show no noise by chance.
constexpr int kStatedFreedom = 10;
constexpr double kMinShareLeft = 0.05;  // of a residual's variance left by the unknowns: below, it is ignored
// Variance of an estimate under Huber's loss over that of plain squares, for Gaussian pairs: with the length
// r of a pair, E[min(r, k)^2] / 2 over (E[1; r < k] + E[k / (2 r); r > k])^2 at k = 2
// (docs/math/color_to_depth.md, eq. 15).
constexpr double kHuberCost = 1.018;

// Pseudo-inverse of a symmetric matrix, scaled by its diagonal against rounding.
Eigen::MatrixXd pseudo_inverse(const Eigen::MatrixXd& H, double least) {
  const Eigen::VectorXd unit = (H.diagonal().array() + 1e-300).rsqrt();
  const Eigen::MatrixXd scaled = unit.asDiagonal() * H * unit.asDiagonal();
  const optim::Eigenpairs<Eigen::Dynamic> pairs = optim::eigenpairs<Eigen::Dynamic>(scaled);
  const double limit = least * pairs.values.cwiseAbs().maxCoeff();
  const Eigen::VectorXd inverse = (pairs.values.array() > limit).select(pairs.values.cwiseInverse(), 0.0);
  return unit.asDiagonal() * (pairs.vectors * inverse.asDiagonal() * pairs.vectors.transpose()) *
         unit.asDiagonal();
}

Eigen::MatrixXd hessian_of(const std::vector<PairResidual>& residuals, const Chosen& chosen, int unknowns) {
  Eigen::MatrixXd H = Eigen::MatrixXd::Zero(unknowns, unknowns);
  for (std::size_t i = 0; i < residuals.size(); ++i)
    if (chosen[i] && residuals[i].known) H += residuals[i].rows.transpose() * residuals[i].rows;
  return H;
}

// The scale of a projective map is held fixed, since no pair determines it.
Eigen::MatrixXd covariance_of(const Eigen::MatrixXd& H, const DepthToColor& map) {
  if (!map.is_projective()) return pseudo_inverse(H, 1e-15);
  Eigen::MatrixXd held = H;
  const Eigen::VectorXd free = map.free_direction();
  held.topLeftCorner(free.size(), free.size()) += H.diagonal().mean() * free * free.transpose();
  return pseudo_inverse(held, 1e-15);
}

// Ratio of the variance to the stated one: as measured if that is larger, else shrunk towards 1 for few data.
double with_the_stated(double measured, int freedom) {
  return std::max(measured, (freedom * measured + kStatedFreedom) / (freedom + kStatedFreedom));
}

// Squared studentised residual r^T (I -+ J H^+ J^T)^-1 r. A fitted pair (minus) has pulled the map towards
// itself; for one not fitted (plus) the uncertainty of the map adds.
double studentised2(const PairResidual& r, const Eigen::MatrixXd& inverse, bool fitted) {
  const Eigen::Matrix2d leverage = r.rows * inverse * r.rows.transpose();
  const Eigen::MatrixXd left = Eigen::Matrix2d::Identity() + (fitted ? -1.0 : 1.0) * leverage;
  const optim::Eigenpairs<Eigen::Dynamic> pairs = optim::eigenpairs<Eigen::Dynamic>(left);
  double sum = 0;
  for (int k = 0; k < 2; ++k) {
    const double along = pairs.vectors.col(k).dot(r.white);
    // A residual that the unknowns fit completely tells nothing about its pair.
    if (pairs.values[k] > kMinShareLeft) sum += along * along / pairs.values[k];
  }
  return sum;
}

bool usable(const PairResidual& r) { return r.known && hypotenuse(r.px.x, r.px.y) < kMaxOff_px; }

std::size_t count_usable(const std::vector<PairResidual>& residuals, const Chosen& kept) {
  std::size_t n = 0;
  for (std::size_t i = 0; i < kept.size(); ++i) n += kept[i] && usable(residuals[i]);
  return n;
}

// The pairs for the next round, and the scale of all residuals. The scale of only the kept pairs would shrink
// with every dropped pair, and more pairs would be dropped.
Chosen chosen_anew(const std::vector<PairResidual>& residuals, const Chosen& kept, int unknowns, int freedom,
                   double* scale) {
  Chosen fitted(kept.size());
  for (std::size_t i = 0; i < kept.size(); ++i) fitted[i] = kept[i] && usable(residuals[i]);
  const Eigen::MatrixXd inverse = pseudo_inverse(hessian_of(residuals, fitted, unknowns), 1e-10);
  std::vector<double> length2(kept.size(), std::numeric_limits<double>::infinity()), known;
  for (std::size_t i = 0; i < kept.size(); ++i)
    if (usable(residuals[i]))
      known.push_back(length2[i] = studentised2(residuals[i], inverse, fitted[i] != 0));
  const double measured = median_of(&known) / kMedianChi2;
  *scale = std::sqrt(with_the_stated(measured, freedom));
  Chosen now(kept.size());
  for (std::size_t i = 0; i < kept.size(); ++i) now[i] = length2[i] < kDroppedChi2 * *scale * *scale;
  return now;
}

// The result at a state, with its covariance.
MapFit finished(const MapState& x, const MapResiduals& residuals, const Chosen& kept, int fixed) {
  const std::vector<PairResidual> found = residuals.at(x);
  MapFit out{x.map, x.offset_s, {}, {}, Chosen(kept.size()), 0};
  double squares = 0;
  for (std::size_t i = 0; i < kept.size(); ++i) {
    out.residual_px.push_back(found[i].px);
    out.kept[i] = kept[i] && usable(found[i]);
    if (out.kept[i]) squares += found[i].white.squaredNorm();
  }
  const int left = std::max(2 * int(count_of(out.kept)) - fixed, 0);
  const double variance = with_the_stated(squares / std::max(left, 1), left);
  const Eigen::VectorXd scales = residuals.scales(x.map);
  const Eigen::MatrixXd H = hessian_of(found, kept, residuals.unknowns(x.map));
  out.covariance =
      kHuberCost * variance * (scales.asDiagonal() * covariance_of(H, x.map) * scales.asDiagonal());
  out.freedom = left + kStatedFreedom;
  return out;
}

}  // namespace

MapFit fit_map(const DepthToColor& start, const BallPairs& pairs, Chosen kept, const BallPath* path,
               double offset_s) {
  const MapResiduals residuals(pairs, path);
  const int unknowns = residuals.unknowns(start), fixed = unknowns - (start.is_projective() ? 1 : 0);
  MapState x{start, offset_s};
  double scale = 1;
  for (int round = 0; round < kRounds; ++round) {
    x = minimum(residuals, x, kept, scale);
    const std::vector<PairResidual> found = residuals.at(x);
    const int freedom = 2 * int(count_usable(found, kept)) - fixed;
    if (freedom <= 0) break;
    Chosen now = chosen_anew(found, kept, unknowns, freedom, &scale);
    if (now == kept) break;
    kept = std::move(now);
  }
  return finished(x, residuals, kept, fixed);
}

}  // namespace sdftrack::calibration
