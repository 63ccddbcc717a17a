// SPDX-License-Identifier: MIT
#include "calibration/noise_fit.h"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>

#include "calibration/ball/median.h"
#include "optim/dense.h"
#include "optim/lm_loop.h"

namespace sdftrack::calibration {

namespace {

constexpr double kSpan = 1.3;  // least ratio of largest to smallest distance to estimate growth
constexpr double kMinTangent = 0.4, kNoiseTangentSpan = 0.3;
constexpr double kNothing = -50, kMostLog = 2;  // limits of the logarithms of the model's numbers
constexpr double kLongestStep = 2;
constexpr double kMin_m = 1e-6;       // least sd of a sample
constexpr int kMostReadings = 20000;  // of a sample: more have common errors
constexpr int kGrowthRounds = 10;

template <class Of>
std::vector<double> each(const std::vector<NoiseSample>& samples, const Of& of) {
  std::vector<double> out;
  for (const NoiseSample& s : samples) out.push_back(of(s));
  return out;
}

double span_of(const std::vector<double>& values) {
  const auto [low, high] = std::minmax_element(values.begin(), values.end());
  return *high - *low;
}

// The system of the three numbers' logarithms, some of which may be fixed.
class NoiseSystem {
 public:
  NoiseSystem(const std::vector<NoiseSample>& samples, const Eigen::Vector3d& start, const bool* free)
      : samples_(samples), free_(free), x_(start) {
    here_ = sums(x_);
  }
  const Eigen::Vector3d& x() const { return x_; }
  double cost() const { return here_.cost; }
  double count() const { return here_.count; }
  bool has_data() const { return here_.count > 0; }
  bool find_step(double damping) {
    Eigen::Matrix3d A = here_.hessian;
    optim::damp(damping, &A);
    const Eigen::Vector3d gradient = here_.gradient;
    const Eigen::Vector3d step = optim::solve_symmetric<3, 1>(A, -gradient);
    trial_ = (x_ + step.cwiseMax(-kLongestStep).cwiseMin(kLongestStep)).cwiseMax(kNothing).cwiseMin(kMostLog);
    return step.allFinite();
  }
  optim::Promise promised() const {
    const Eigen::VectorXd step = trial_ - x_;
    const double all = -(here_.gradient.dot(step) + 0.5 * step.dot(here_.hessian * step));
    return {all, all};
  }
  double look() {
    next_ = sums(trial_);
    return next_.cost;
  }
  void accept(bool) { x_ = trial_, here_ = next_; }
  bool step_is_small() const { return (trial_ - x_).cwiseAbs().maxCoeff() < 1e-9; }

 private:
  optim::NormalEquations sums(const Eigen::Vector3d& x) const {
    const double a = std::exp(x[0]), b = std::exp(x[1]), c = std::exp(x[2]);
    optim::NormalEquations out;
    out.reset(3);
    for (const NoiseSample& s : samples_) {
      const double weight = std::min(s.readings, kMostReadings), z2 = s.depth_m * s.depth_m;
      const double straight = a + b * z2, slanted = c * s.depth_m * s.tangent;
      const double variance = straight * straight + slanted * slanted;
      const double r = 0.5 * std::log(variance) - std::log(std::max(s.sd_m, kMin_m));
      Eigen::Vector3d J(straight * a / variance, straight * b * z2 / variance, slanted * slanted / variance);
      for (int k = 0; k < 3; ++k)
        if (!free_[k]) J[k] = 0;
      out.hessian += weight * J * J.transpose(), out.gradient += weight * r * J;
      out.cost += 0.5 * weight * r * r, out.count += 1;
    }
    return out;
  }

  const std::vector<NoiseSample>& samples_;
  const bool* free_;
  Eigen::Vector3d x_, trial_;
  optim::NormalEquations here_, next_;
};

// Least |value - fit|, with squares near 0.
Eigen::Vector2d weighted_growth(const std::vector<double>& z, const std::vector<double>& value,
                                const std::vector<double>& weights) {
  Eigen::MatrixXd A = Eigen::MatrixXd::Zero(2, 2);
  Eigen::VectorXd b = Eigen::VectorXd::Zero(2);
  for (std::size_t i = 0; i < z.size(); ++i) {
    const Eigen::Vector2d row(1, z[i] * z[i]);
    A += weights[i] * row * row.transpose(), b += weights[i] * value[i] * row;
  }
  return optim::solve_symmetric<Eigen::Dynamic, 1>(A, b);
}

}  // namespace

bool span_is_wide(const std::vector<double>& depth_m) {
  const auto [low, high] = std::minmax_element(depth_m.begin(), depth_m.end());
  return *high > kSpan * *low;
}

NoiseModel fit_noise(const std::vector<NoiseSample>& samples) {
  const std::vector<double> z = each(samples, [](const NoiseSample& s) { return s.depth_m; });
  const std::vector<double> tangent = each(samples, [](const NoiseSample& s) { return s.tangent; });
  const auto sd_of = [](const NoiseSample& s) { return std::max(s.sd_m, kMin_m); };
  std::vector<double> sd = each(samples, sd_of);
  std::vector<double> by_z = each(samples, [&](const NoiseSample& s) { return sd_of(s) / s.depth_m; });
  std::vector<double> by_z2 =
      each(samples, [&](const NoiseSample& s) { return sd_of(s) / (s.depth_m * s.depth_m); });
  const bool free[] = {true, span_is_wide(z),
                       *std::max_element(tangent.begin(), tangent.end()) > kMinTangent &&
                           span_of(tangent) > kNoiseTangentSpan};
  Eigen::Vector3d start(std::log(0.7 * median_of(&sd)), std::log(0.3 * median_of(&by_z2)),
                        std::log(0.3 * median_of(&by_z)));
  for (int k = 0; k < 3; ++k)
    if (!free[k]) start[k] = kNothing;
  NoiseSystem system(samples, start, free);
  optim::LmRules rules;
  rules.max_steps = 100, rules.damping = 1e-2, rules.damping_up = 5, rules.damping_down = 1.0 / 3;
  rules.cost_relative = 1e-12;
  optim::LmRecord record;
  optim::run_lm(system, rules, &record);
  const auto number = [&](int k) {
    const double value = std::exp(system.x()[k]);
    return value > kMin_m ? value : 0.0;
  };
  return {number(0), number(1), number(2)};
}

Growth fit_growth(const std::vector<double>& depth_m, const std::vector<double>& value, bool is_signed) {
  const std::size_t n = depth_m.size();
  std::vector<double> all = value;
  if (!span_is_wide(depth_m)) return {median_of(&all), 0};
  std::vector<double> weights(n, 1.0);
  Eigen::Vector2d x = weighted_growth(depth_m, value, weights);
  for (int round = 0; round < kGrowthRounds; ++round) {
    std::vector<double> off(n);
    for (std::size_t i = 0; i < n; ++i) off[i] = std::abs(value[i] - x[0] - x[1] * depth_m[i] * depth_m[i]);
    std::vector<double> sizes = off;
    const double least = std::max(1e-9, 0.3 * median_of(&sizes));
    for (std::size_t i = 0; i < n; ++i) weights[i] = 1 / std::max(off[i], least);
    x = weighted_growth(depth_m, value, weights);
  }
  if (!is_signed && x[0] < 0) {
    for (std::size_t i = 0; i < n; ++i) all[i] = value[i] / (depth_m[i] * depth_m[i]);
    return {0, std::max(0.0, median_of(&all))};
  }
  if (!is_signed && x[1] < 0) return {std::max(0.0, median_of(&all)), 0};
  return {x[0], x[1]};
}

double correlation_length(double neighbours) {
  return std::sqrt(-1 / (2 * std::log(std::clamp(neighbours, 1e-9, 0.999))));
}

}  // namespace sdftrack::calibration
