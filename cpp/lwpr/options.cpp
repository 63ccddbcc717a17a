// SPDX-License-Identifier: MIT
#include "lwpr/options.h"

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <cmath>
#include <sstream>
#include <stdexcept>

namespace sdftrack {

namespace {

void check_range(const char* name, double value, bool ok, const char* expected) {
  if (ok && std::isfinite(value)) return;
  std::ostringstream text;
  text << name << ": expected " << expected << ", got " << value;
  throw std::invalid_argument(text.str());
}

[[noreturn]] void refuse_metric(const std::string& got) {
  throw std::invalid_argument(
      "init_D: expected a number above 0, one for each input, or a symmetric positive definite matrix (n_in, "
      "n_in), got " +
      got);
}

}  // namespace

void check_lwpr_options(const LwprOptions& o) {
  check_range("w_gen", o.w_gen, o.w_gen > 0 && o.w_gen < 1, "a number between 0 and 1");
  check_range("w_prune", o.w_prune, o.w_prune > o.w_gen && o.w_prune <= 1, "a number above w_gen, at most 1");
  check_range("w_cutoff", o.w_cutoff, o.w_cutoff >= 1e-12 && o.w_cutoff < o.w_gen,
              "a number from 1e-12 to below w_gen");
  check_range("init_alpha", o.init_alpha, o.init_alpha > 0, "a number above 0");
  check_range("meta_rate", o.meta_rate, o.meta_rate > 0, "a number above 0");
  check_range("penalty", o.penalty, o.penalty >= 0, "a number of at least 0");
  check_range("add_threshold", o.add_threshold, o.add_threshold >= 0 && o.add_threshold <= 1,
              "a number from 0 to 1");
  check_range("init_lambda", o.init_lambda, o.init_lambda > 0 && o.init_lambda <= 1,
              "a number above 0, at most 1");
  check_range("final_lambda", o.final_lambda, o.final_lambda > 0 && o.final_lambda <= 1,
              "a number above 0, at most 1");
  check_range("tau_lambda", o.tau_lambda, o.tau_lambda >= 0 && o.tau_lambda <= 1, "a number from 0 to 1");
  if (o.init_D.empty()) refuse_metric("nothing");
}

std::vector<double> initial_metric(const LwprOptions& options, int n_in) {
  const auto n = static_cast<std::size_t>(n_in), given = options.init_D.size();
  for (const double d : options.init_D)
    if (!std::isfinite(d)) refuse_metric("a number that is not finite");
  if (given != n * n || n == 1) {
    if (given != 1 && given != n)
      refuse_metric(std::to_string(given) + " numbers for n_in=" + std::to_string(n_in));
    for (const double d : options.init_D)
      if (!(d > 0)) refuse_metric("a number that is not above 0");
  }
  if (options.diagonal && given != n * n) {
    std::vector<double> M;
    for (std::size_t i = 0; i < n; ++i) M.push_back(std::sqrt(options.init_D[given == 1 ? 0 : i]));
    return M;
  }
  Eigen::MatrixXd D = Eigen::MatrixXd::Zero(n_in, n_in);
  for (std::size_t i = 0; i < n; ++i)
    for (std::size_t j = 0; j < n; ++j) {
      const auto row = static_cast<Eigen::Index>(i), column = static_cast<Eigen::Index>(j);
      if (given == n * n)
        D(row, column) = options.init_D[i * n + j];
      else if (i == j)
        D(row, column) = options.init_D[given == 1 ? 0 : i];
    }
  const Eigen::LLT<Eigen::MatrixXd> factor(D);
  if (!D.isApprox(D.transpose(), 1e-9) || factor.info() != Eigen::Success)
    refuse_metric("a matrix that is not");
  const Eigen::MatrixXd M = factor.matrixU();
  std::vector<double> out;
  for (Eigen::Index i = 0; i < n_in; ++i)
    for (Eigen::Index j = i; j < (options.diagonal ? i + 1 : n_in); ++j) out.push_back(M(i, j));
  if (options.diagonal && !D.isDiagonal())
    refuse_metric("a matrix that is not diagonal together with diagonal=True");
  return out;
}

}  // namespace sdftrack
