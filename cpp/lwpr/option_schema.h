// SPDX-License-Identifier: MIT
// The options of LWPR, one line each: a new one is a member of LwprOptions and a line here.
#pragma once

#include "base/option_schema.h"
#include "lwpr/options.h"

namespace sdftrack::lwpr {

// A finite number without an upper bound.
constexpr OptionRange kFinitePositive = above(0).below(kNoBound);
constexpr OptionRange kFiniteNonNegative = at_least(0).below(kNoBound);

// clang-format off
template <OptionsOf<LwprOptions> Options, class Visit>
void visit_options(Options& o, Visit& f) {
  f("w_gen", o.w_gen, above(0).below(1), "", "a sample whose activation stays below this in every receptive field creates a new one");
  f("w_prune", o.w_prune, above(0).up_to(1), "", "if a sample activates two receptive fields above this, one of them is pruned; must exceed w_gen");
  f("w_cutoff", o.w_cutoff, at_least(1e-12).below(1), "", "activations below this are treated as 0; must be below w_gen");
  f("init_D", o.init_D, kNumberArray, "", "initial distance metric of a new receptive field, for inputs divided by norm_in: a number, one per input, or a matrix");
  f("diagonal", o.diagonal, kTrueOrFalse, "", "restrict the distance metric to a diagonal matrix");
  f("update_D", o.update_D, kTrueOrFalse, "", "learn the distance metric");
  f("init_alpha", o.init_alpha, kFinitePositive, "", "initial learning rate of the distance metric");
  f("meta", o.meta, kTrueOrFalse, "", "adapt the learning rates as well (second-order learning)");
  f("meta_rate", o.meta_rate, kFinitePositive, "", "meta learning rate");
  f("penalty", o.penalty, kFiniteNonNegative, "", "gamma of Eq. 6.13: regularisation that prevents receptive fields from shrinking without limit");
  f("add_threshold", o.add_threshold, from_to(0, 1), "", "a projection is added if the last one left less than this share of the mean squared error");
  f("init_lambda", o.init_lambda, above(0).up_to(1), "", "initial forgetting factor of a receptive field");
  f("final_lambda", o.final_lambda, above(0).up_to(1), "", "final forgetting factor");
  f("tau_lambda", o.tau_lambda, from_to(0, 1), "", "annealing rate from init_lambda to final_lambda");
}
// clang-format on

}  // namespace sdftrack::lwpr
