// SPDX-License-Identifier: MIT
// The options of a reconstruction, one line each for each member of ReconstructionOptions.
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
  f("evolution", o.evolved, Choices<bool>(kEvolutions), "", "ours, or printed: evidence, gradient flow and tracker of the thesis (Eqs. 4.18, 4.29 to 4.42)");
  f("evidence", e.form.printed, Choices<bool>(kEvidenceForms), "", "likelihood of a voxel: smooth, or printed (thesis Eqs. 4.29 to 4.31)");
  f("sigma_d_m", e.form.sigma_d_m, above(0), "m", "support of the likelihood around a depth measurement; nothing is inferred from twice that distance behind it");
  f("sigma_d_voxels", o.sigma_d_voxels, above(0), "voxels", "replaces sigma_d_m when evolution is printed, as in the thesis");
  f("evolution_steps", o.evolution_steps, at_least(1), "", "steps of the printed evolution per frame; 100 after the first frame");
  f("redistance_every", o.redistance_every, at_least(0), "", "steps of the printed evolution after which its field is made a signed distance again; 0: never, which loses the object");
  f("noise_m", o.noise_m, above(0).or_none(), "m", "standard deviation of the depth noise; None: estimated within the mask of the first frame");
  f("noise_per_m", e.noise.noise_per_m, at_least(0), "1/m", "depth noise grows with distance: noise_m + noise_per_m Z^2");
  f("carve_from_m", e.carve_from_m, above(0), "m", "no free space is carved within this distance in front of a depth measurement");
  f("memory", e.max_weight, above(0), "", "maximum number of frames averaged in a voxel; fewer forget errors sooner, more reduce noise further");
  f("known_every", e.known_every, at_least(1), "", "once a block has been observed in 30 frames, only every n-th further frame is fused into it; 1: every frame");
  f("border_px", o.image.border_px, at_least(0), "px", "object pixels within this distance of the silhouette or of a depth discontinuity are ignored");
  f("prior", o.prior, at_least(0), "", "log ratio of the initial guess, positive inside, negative outside; 0: no prior");
  f("min_seen", o.min_seen, at_least(0), "", "a surface patch is used for tracking once it has been observed in this many (frontal) views");
  f("padding_m", o.padding_m, above(0), "m", "pixels within this distance of the current shape are considered in the next frame");
  f("planes", o.planes, kTrueOrFalse, "", "planes that extend beyond the first mask (table, wall), and what lies behind them, are not part of the object");
  f("keep_to_mask", o.keep_to_mask, kTrueOrFalse, "", "the object is excluded where the first frame observes free space outside its mask");
  f("mask_margin_px", o.mask_margin_px, from_to(0, 100), "px", "how far the object may extend beyond the first mask");
  f("settle_after", o.settle_after, at_least(0), "", "number of frames after which the first one is placed on the shape again and the shape is rebuilt there; 0: never");
  f("kept_frames", o.kept_frames, at_least(1), "", "maximum number of frames kept for refine() and save(): the first, and others spread over all viewpoints");
}
// clang-format on

}  // namespace sdftrack::reconstruction
