// SPDX-License-Identifier: MIT
// The options of locally weighted projection regression; docs/lwpr.md explains each.
#pragma once

#include <vector>

namespace sdftrack::lwpr {

struct LwprOptions {
  double w_gen = 0.2;      // no activation above it: a new field is created
  double w_prune = 0.95;   // two activations above it: one field is removed
  double w_cutoff = 0.01;  // activations below it count as 0
  // The initial metric: one number, one for each input, or n_in x n_in numbers row by row.
  std::vector<double> init_D = {25};
  bool diagonal = false;   // the metric stays diagonal
  bool update_D = true;    // the metric is learnt
  double init_alpha = 50;  // its learning rate
  bool meta = false;       // learning rates are learnt as well
  double meta_rate = 1;    // how fast the learning rates are learnt
  double penalty = 1e-8;   // gamma of eq. 6.13: against ever smaller fields
  double add_threshold =
      0.5;  // phi: another projection where the last one left less than this share of the error
  double init_lambda = 0.999;  // forgetting: initial value, final value, and rate of change
  double final_lambda = 0.99999;
  double tau_lambda = 0.9999;

  bool operator==(const LwprOptions&) const = default;
  // Throws std::invalid_argument that names the first option out of range.
  void check() const;
};

// M of the first metric, D = M^T M: n (n + 1) / 2 numbers, the rows of the upper triangle one after the
// other, or n for a diagonal metric. Throws std::invalid_argument if init_D is not a metric of n inputs.
std::vector<double> initial_metric(const LwprOptions& options, int n_in);

}  // namespace sdftrack::lwpr
