// SPDX-License-Identifier: MIT
// The options of a reconstruction, one line each: a new one is a member of ReconstructionOptions and a line
// here.
#pragma once

#include "base/option_schema.h"
#include "reconstruction/reconstruction.h"

namespace sdftrack::reconstruction {

inline constexpr Choice<bool> kEvolutions[] = {{false, "ours"}, {true, "printed"}};
inline constexpr Choice<bool> kEvidenceForms[] = {{false, "smooth"}, {true, "printed"}};

// clang-format off
template <OptionsOf<ReconstructionOptions> Options, class Visit>
void visit_options(Options& o, Visit& f) {
  auto& e = o.evidence;
  f("evolution", o.evolved, Choices<bool>(kEvolutions), "", "ours, or printed: the thesis' evidence, gradient flow and tracker (Eqs. 4.18, 4.29 to 4.42)");
  f("evidence", e.form.printed, Choices<bool>(kEvidenceForms), "", "likelihood of a voxel: smooth, or printed (thesis Eqs. 4.29 to 4.31)");
  f("sigma_d_m", e.form.sigma_d_m, above(0), "m", "how far from a reading it says something; from twice that behind it nothing is said");
  f("sigma_d_voxels", o.sigma_d_voxels, above(0), "voxels", "in place of sigma_d_m with evolution printed, as the thesis has it");
  f("evolution_steps", o.evolution_steps, at_least(1), "", "of the printed evolution after each frame; 100 after the first");
  f("noise_m", e.noise.noise_m, above(0).or_none(), "m", "sd of the depth; None: measured on the first frame's mask");
  f("noise_per_m", e.noise.noise_per_m, at_least(0), "1/m", "the noise grows as noise_m + noise_per_m Z^2");
  f("carve_from_m", e.carve_from_m, above(0), "m", "nearer before a reading nothing is carved");
  f("memory", e.max_weight, above(0), "", "frames that a voxel remembers; fewer forget mistakes sooner, more average better");
  f("known_every", e.known_every, at_least(1), "", "a place that 30 frames have shown takes one of so many that follow; 1: all of them");
  f("border_px", o.image.border_px, at_least(0), "px", "the object's pixels this near to an outline or a jump of depth say nothing");
}
// clang-format on

}  // namespace sdftrack::reconstruction
