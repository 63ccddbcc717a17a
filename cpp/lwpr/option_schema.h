// SPDX-License-Identifier: MIT
// The options of LWPR, one line each: a new one is a member of LwprOptions and a line here.
#pragma once

#include "base/option_schema.h"
#include "lwpr/options.h"

namespace sdftrack::lwpr {

// A number without an upper end, but finite.
constexpr OptionRange kFinitePositive = above(0).below(kNoBound);
constexpr OptionRange kFiniteNonNegative = at_least(0).below(kNoBound);

// clang-format off
template <OptionsOf<LwprOptions> Options, class Visit>
void visit_options(Options& o, Visit& f) {
  f("w_gen", o.w_gen, above(0).below(1), "", "a sample that activates no field above it gets a field of its own");
  f("w_prune", o.w_prune, above(0).up_to(1), "", "of two fields that a sample activates above it, one goes; above w_gen");
  f("w_cutoff", o.w_cutoff, at_least(1e-12).below(1), "", "activations below it count as 0; below w_gen");
  f("init_D", o.init_D, kNumberArray, "", "metric of a new field, for inputs divided by norm_in: a number, one for each input, or a matrix");
  f("diagonal", o.diagonal, kTrueOrFalse, "", "the metric stays diagonal");
  f("update_D", o.update_D, kTrueOrFalse, "", "the metric is learnt");
  f("init_alpha", o.init_alpha, kFinitePositive, "", "its learning rate");
  f("meta", o.meta, kTrueOrFalse, "", "learning rates are learnt as well");
  f("meta_rate", o.meta_rate, kFinitePositive, "", "how fast they are");
  f("penalty", o.penalty, kFiniteNonNegative, "", "gamma of Eq. 6.13: against ever smaller fields");
  f("add_threshold", o.add_threshold, from_to(0, 1), "", "another projection where the last one left less than this share of the mean squared error");
  f("init_lambda", o.init_lambda, above(0).up_to(1), "", "forgetting of a field at first");
  f("final_lambda", o.final_lambda, above(0).up_to(1), "", "forgetting in the end");
  f("tau_lambda", o.tau_lambda, from_to(0, 1), "", "the pace between them");
}
// clang-format on

}  // namespace sdftrack::lwpr
