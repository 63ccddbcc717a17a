// SPDX-License-Identifier: MIT
#include "calibration/registration/ball_path.h"

#include <algorithm>
#include <stdexcept>
#include <utility>

#include "calibration/ball/median.h"

namespace sdftrack::calibration {

namespace {

constexpr double kJump = 6, kJump_m = 0.03;  // usual deviations, plus metres
constexpr double kLongestGap = 2.5;          // usual periods that the path bridges
constexpr std::size_t kSlopePoints = 5;
constexpr double kAtAPoint = 1e-9;  // of a segment

// Derivative at time_s of the polynomial through points: Lagrange's form.
Vec3d slope_at(double time_s, const TimedPoint* points, std::size_t n) {
  Vec3d slope{0, 0, 0};
  for (std::size_t j = 0; j < n; ++j) {
    double weight = 0;
    for (std::size_t m = 0; m < n; ++m) {
      if (m == j) continue;
      double term = 1 / (points[j].time_s - points[m].time_s);
      for (std::size_t i = 0; i < n; ++i)
        if (i != j && i != m) term *= (time_s - points[i].time_s) / (points[j].time_s - points[i].time_s);
      weight += term;
    }
    slope = slope + weight * points[j].center_cam;
  }
  return slope;
}

}  // namespace

BallPath::BallPath(std::vector<TimedPoint> points) : points_(std::move(points)), slope_(points_.size()) {
  const std::size_t n = points_.size();
  if (n < 2) throw std::invalid_argument("points: expected at least two of a path");
  std::vector<double> steps;
  for (std::size_t i = 1; i < n; ++i) steps.push_back(points_[i].time_s - points_[i - 1].time_s);
  period_s_ = median_of(&steps);
  // A slope across a gap tells little about the motion on either side: runs are kept separate.
  for (std::size_t first = 0, last; first < n; first = last) {
    for (last = first + 1; last < n && !is_wide(last - 1);) ++last;
    const std::size_t used = std::min(kSlopePoints, last - first);
    for (std::size_t k = first; k < last; ++k) {
      const std::size_t from = std::min(std::max(first + 2, k) - 2, last - used);
      slope_[k] = slope_at(points_[k].time_s, &points_[from], used);
    }
  }
}

bool BallPath::is_wide(std::size_t segment) const {
  return points_[segment + 1].time_s - points_[segment].time_s > kLongestGap * period_s_;
}

BallPath BallPath::through(std::vector<TimedPoint> points) {
  // The farthest is removed first, because it also affects its neighbours.
  while (points.size() > kSlopePoints) {
    std::vector<double> off;
    for (std::size_t i = 1; i + 1 < points.size(); ++i) {
      const TimedPoint &a = points[i - 1], &b = points[i], &c = points[i + 1];
      const double s = (b.time_s - a.time_s) / (c.time_s - a.time_s);
      off.push_back(norm(b.center_cam - (1 - s) * a.center_cam - s * c.center_cam));
    }
    const auto worst = std::max_element(off.begin(), off.end()) - off.begin();
    const double most = off[worst];
    if (most < kJump * median_of(&off) + kJump_m) break;
    points.erase(points.begin() + worst + 1);
  }
  return BallPath(std::move(points));
}

std::optional<BallPath::At> BallPath::at(double time_s) const {
  const auto after = std::upper_bound(points_.begin(), points_.end(), time_s,
                                      [](double t, const TimedPoint& p) { return t < p.time_s; });
  const auto k = std::size_t(
      std::clamp<std::ptrdiff_t>(after - points_.begin() - 1, 0, std::ptrdiff_t(points_.size()) - 2));
  const TimedPoint &from = points_[k], &to = points_[k + 1];
  const double h = to.time_s - from.time_s, u = (time_s - from.time_s) / h;
  // At a measured point gaps do not matter.
  if (!(u >= -kAtAPoint && u <= 1 + kAtAPoint)) return std::nullopt;
  if (is_wide(k) && u > kAtAPoint && u < 1 - kAtAPoint) return std::nullopt;
  const Vec3d a = from.center_cam, b = to.center_cam, m = h * slope_[k], n = h * slope_[k + 1];
  const double v = 1 - u;
  return At{((1 + 2 * u) * v * v) * a + (u * v * v) * m + (u * u * (3 - 2 * u)) * b - (u * u * v) * n,
            (1 / h) * ((6 * u * (u - 1)) * (a - b) + (v * (1 - 3 * u)) * m + (u * (3 * u - 2)) * n),
            v * v + u * u};
}

}  // namespace sdftrack::calibration
