// SPDX-License-Identifier: MIT
#include "lwpr/options.h"

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <cmath>
#include <stdexcept>

#include "lwpr/option_schema.h"

namespace sdftrack::lwpr {

namespace {

[[noreturn]] void refuse_metric(const std::string& got) {
  throw std::invalid_argument(
      "init_D: expected a number above 0, one for each input, or a symmetric positive definite matrix (n_in, "
      "n_in), got " +
      got);
}

}  // namespace

void LwprOptions::check() const {
  check_options(*this);
  check_option(
      {.name = "w_prune", .kind = OptionKind::kNumber, .value = w_prune, .range = above(w_gen).up_to(1)});
  check_option({.name = "w_cutoff",
                .kind = OptionKind::kNumber,
                .value = w_cutoff,
                .range = at_least(1e-12).below(w_gen)});
  if (init_D.empty()) refuse_metric("nothing");
}

std::vector<double> initial_metric(const LwprOptions& options, int n_in) {
  const auto n = std::size_t(n_in), given = options.init_D.size();
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
  if (options.diagonal && !D.isDiagonal()) refuse_metric("a non-diagonal matrix with diagonal=True");
  return out;
}

}  // namespace sdftrack::lwpr
