// SPDX-License-Identifier: MIT
// The options of a memory of silhouettes, one line each: a new one is a member of MemoryOptions and a line
// here.
#pragma once

#include "base/option_schema.h"
#include "contour/memory/silhouette_memory.h"

namespace sdftrack::contour {

enum class MemoryRule {
  kRemembered,  // stored silhouettes explain what is seen
  kPrinted,     // low harmonics from high ones, judged by the residuals of what was learned (Table 6.3)
  kRegressed,   // the same, judged by the errors of silhouettes before they were learned
};

struct MemoryOptions {
  SilhouetteMemory::Options remembered;
  // Those of the thesis are Python around lwpr.
  MemoryRule rule = MemoryRule::kRemembered;
  int n_inputs = 3;
  double w_gen = 0.1, reach = 0.1;
  int settle = 20;

  // Throws std::invalid_argument that names the first invalid option.
  void check() const;
};

inline constexpr Choice<MemoryRule> kRules[] = {{MemoryRule::kRemembered, "remembered"},
                                                {MemoryRule::kPrinted, "printed"},
                                                {MemoryRule::kRegressed, "regressed"}};
inline constexpr Choice<HarmonicOrder> kOrders[] = {{HarmonicOrder::kMax, "max"},
                                                    {HarmonicOrder::kSum, "sum"}};

// clang-format off
template <OptionsOf<MemoryOptions> Options, class Visit>
void visit_options(Options& o, Visit& f) {
  auto& library = o.remembered.library;
  f("n_harmonics", library.n_harmonics, from_to(2, 32), "", "number of harmonics that describe a silhouette");
  f("n_inputs", o.n_inputs, from_to(1, 31), "", "number of the highest harmonics that predict the others (printed, regressed); must be below n_harmonics");
  f("rule", o.rule, Choices<MemoryRule>(kRules), "", "how occluded parts are recovered: from stored silhouettes, as printed (Table 6.3), or as printed but judged by the errors of silhouettes before they were learned");
  f("order", library.order, Choices<HarmonicOrder>(kOrders), "", "how coefficients form a harmonic: all C(u, v) with equal max(u, v), or with equal u + v");
  f("size", library.size, from_to(16, 256), "px", "side of the grid to which silhouettes are normalised");
  f("capacity", library.capacity, from_to(2, 4096), "", "maximum number of stored silhouettes (remembered)");
  f("spacing", library.spacing, from_to(0, 1), "", "minimum dissimilarity of two stored silhouettes: symmetric difference over area (remembered)");
  f("max_occluders", o.remembered.max_occluders, from_to(1, 1000), "", "a silhouette with more occluders than this is novel (remembered)");
  f("calibrate_on", o.remembered.calibrate_on, from_to(1, 1e9), "", "number of known silhouettes whose error sets the threshold (remembered)");
  f("w_gen", o.w_gen, from_to(0, 1), "", "a silhouette is unknown if its activation is below this (printed, regressed)");
  f("reach", o.reach, from_to(1e-6, 1e6), "", "distance metric of the receptive fields, D = reach / n_inputs; smaller values generalise farther (printed, regressed)");
  f("settle", o.settle, from_to(2, 1e6), "", "number of silhouettes that determine the scale of the inputs (printed, regressed)");
}
// clang-format on

}  // namespace sdftrack::contour
