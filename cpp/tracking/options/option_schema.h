// SPDX-License-Identifier: MIT
// The options of the tracker, one line each: a new one is a member of TrackerOptions and a line here.
#pragma once

#include "base/option_schema.h"
#include "tracking/options/options.h"

namespace sdftrack::tracking {

inline constexpr Choice<energies::Residual> kResiduals[] = {{energies::Residual::kPoint, "point"},
                                                            {energies::Residual::kSlope, "slope"},
                                                            {energies::Residual::kRayHit, "ray_hit"}};
inline constexpr Choice<energies::Curvature> kCurvatures[] = {{energies::Curvature::kIrls, "irls"},
                                                              {energies::Curvature::kPrinted, "printed"}};
inline constexpr Choice<energies::ColorLikelihood> kColorLikelihoods[] = {
    {energies::ColorLikelihood::kOdds, "odds"}, {energies::ColorLikelihood::kPrinted, "printed"}};

inline constexpr Choice<bool> kStopRules[] = {{false, "gain"}, {true, "printed"}};

// Beyond it a length, a weight or a count is a mistake.
constexpr double kOptionLimit = 1e9;
constexpr OptionRange kPositive = above(0).below(kOptionLimit);
constexpr OptionRange kNonNegative = at_least(0).below(kOptionLimit);

// clang-format off
template <OptionsOf<TrackerOptions> Options, class Visit>
void visit_options(Options& o, Visit& f) {
  f("residual", o.residual, Choices<energies::Residual>(kResiduals), "", "ray_hit: depth where the ray meets the model minus measured; slope; point: as printed (Eq. 3.11)");
  f("curvature", o.curvature, Choices<energies::Curvature>(kCurvatures), "", "irls, or printed: J^T J of the log-likelihood's gradient (Eq. 3.18)");
  f("outlier_floor", o.outlier_floor, at_least(0).below(1), "", "share of outliers in the likelihood; 0: as printed");
  f("scale_start_m", o.scale_start_m, kNonNegative, "m", "s of the first coarse stage, halved stage by stage; 0: none");
  f("scale_per_noise", o.scale_per_noise, kPositive, "", "s of the last stage over the sensor's noise");
  f("noise_m", o.noise_m, kPositive, "m", "sensor noise sigma(Z) = noise_m + noise_per_m Z^2");
  f("noise_per_m", o.noise_per_m, kNonNegative, "1/m", "see noise_m");
  f("adapt_noise", o.adapt_noise, kTrueOrFalse, "", "rescale sigma(Z) by the residuals, frame by frame");
  f("systematic_m", o.systematic_m, kNonNegative, "m", "sd of the depth error that neighbouring readings share (stereo, time of flight); 0: learnt at a given pose");
  f("max_systematic_m", o.max_systematic_m, kNonNegative, "m", "most that is learnt for systematic_m");
  f("systematic_per_m", o.systematic_per_m, kNonNegative, "1/m", "grows with distance: systematic_m + systematic_per_m Z^2");
  f("lateral_px", o.lateral_px, kNonNegative, "px", "sd of where the depth image lies against its intrinsics; widens the covariance");
  f("correlation_area_px", o.correlation_area_px, kNonNegative, "px", "pixels that share one error; widens the covariance; 0: measured");
  f("min_correlation_area_px", o.min_correlation_area_px, kNonNegative, "px", "least that is measured for correlation_area_px");
  f("padding_m", o.padding_m, kNonNegative, "m", "pixels count this near the object's box at its last pose");
  f("retry_inliers", o.retry_inliers, kNonNegative, "", "at a start: share of agreeing points below which a wider attempt is made; 0: never one");
  f("far_scale_m", o.far_scale_m, kNonNegative, "m", "scale_start_m of that attempt");
  f("far_padding_m", o.far_padding_m, kNonNegative, "m", "padding_m of that attempt");
  f("max_pixels", o.max_pixels, kPositive, "", "budget of the last stage");
  f("coarse_pixels", o.coarse_pixels, kPositive, "", "budget of the coarse stages");
  f("min_pixels", o.min_pixels, kPositive, "", "fewer readings near the object: lost");
  f("fine_first", o.fine_first, kTrueOrFalse, "", "begin each frame without coarse stages, which a hand on the object would draw along");
  f("damping_start", o.damping_start, kNonNegative, "", "Levenberg-Marquardt damping (the source starts at 100)");
  f("keep_damping", o.keep_damping, kTrueOrFalse, "", "carry the damping from frame to frame");
  f("stop_rule", o.stop_printed, Choices<bool>(kStopRules), "", "gain: a stage ends where its next step promises little; printed: where the damping passes 10e6 (Table 3.2)");
  f("coarse_floor", o.coarse_floor, at_least(0).below(1), "", "outlier_floor of the coarse stages, for readings in front of the surface");
  f("coarse_floor_behind", o.coarse_floor_behind, at_least(0).below(1), "", "the same behind it, where nothing can hide");
  f("coarse_steps", o.coarse_steps, kNonNegative, "", "trials per coarse stage");
  f("fine_steps", o.fine_steps, kPositive, "", "trials of the last stage");
  f("free_space", o.free_space, kTrueOrFalse, "", "a model point may not stand where the sensor sees past it");
  f("free_space_scale_m", o.free_space_scale_m, kPositive, "m", "s of the free-space term");
  f("free_space_weight", o.free_space_weight, kNonNegative, "", "1: all surface points weigh as much as all pixels");
  f("free_space_points", o.free_space_points, kPositive, "", "surface points of the free-space term");
  f("motion_sigma_m", o.motion_sigma_m, kNonNegative, "m", "weak prior about the predicted pose; 0: none");
  f("motion_sigma_rad", o.motion_sigma_rad, kNonNegative, "rad", "the same for the rotation");
  f("drop_plane", o.drop_plane, kTrueOrFalse, "", "leave out the pixels of the dominant plane (a table)");
  f("collision_tolerance_m", o.collision_tolerance_m, kPositive, "m", "how deep objects may stand in one another, as one standard deviation");
  f("union_sharpness", o.union_sharpness, kPositive, "", "of the soft minimum of several objects, per voxel, in the last stages");
  f("coarse_union_sharpness", o.coarse_union_sharpness, kPositive, "", "the same in the coarse stages; 2 is the source's (thesis, section 5.2)");
  f("color_likelihood", o.color_likelihood, Choices<energies::ColorLikelihood>(kColorLikelihoods), "", "odds: the colour sets each pixel's share of outliers; printed: P_f d_on + P_b H_out (Eq. 4.18)");
  f("color_prior", o.color_prior, above(0).below(1), "", "posterior of a colour that says nothing");
  f("color_object_rate", o.color_object_rate, from_to(0, 1), "", "share of each new frame in the object's histogram (Eq. 4.22)");
  f("color_background_rate", o.color_background_rate, from_to(0, 1), "", "the same for the background's");
  f("smooth_colors", o.smooth_colors, kTrueOrFalse, "", "whether a reading is the object's is asked of the readings around it, too");
  f("color_free_space", o.color_free_space, kTrueOrFalse, "", "a pixel without depth but of the background's colour is free space");
  f("color_max_overlap", o.color_max_overlap, kNonNegative, "", "auto: depth alone where sum sqrt(p_f p_b) of the histograms is above");
  f("photometric", o.photometric, kTrueOrFalse, "", "with a coloured shape and colour images: their brightness holds the pose too");
  f("photometric_sigma", o.photometric_sigma, kPositive, "", "standard deviation of a pixel's brightness, of its full range");
  f("photometric_weight", o.photometric_weight, kPositive, "", "of that term; 1: as its noise says");
  f("photometric_pixels", o.photometric_pixels, kPositive, "", "pixels that it looks at");
  f("outline", o.outline, kTrueOrFalse, "", "with colour images: the object's outline in them holds the pose too, and alone where a frame has no depth");
  f("outline_weight", o.outline_weight, kPositive, "", "of that term; 1: as its noise and that of the depth say");
  f("outline_points", o.outline_points, from_to(20, 2000), "", "places on the outline that it looks at");
  f("outline_reach_px", o.outline_reach_px, from_to(4, 64), "px", "how far to both sides of the outline it looks, near the pose");
  f("outline_far_px", o.outline_far_px, from_to(4, 64), "px", "the same where the pose may be farther off");
  f("outline_from_m", o.outline_from_m, kNonNegative, "m", "beside depth only where its readings are seen to share an error as large as this; 0: always");
  f("outline_local", o.outline_local, kTrueOrFalse, "", "the colours on its two sides are learnt place by place; False: those of the whole object and of all around it");
  f("recover_seeds", o.recover_seeds, kPositive, "", "rotations that a search for a lost object tries per frame, of 240: bounds its time");
  f("lost_inliers", o.lost_inliers, kNonNegative, "", "lost below this share of agreeing points among those not hidden");
  f("weak_inliers", o.weak_inliers, kNonNegative, "", "weak below it");
  f("lost_evidence", o.lost_evidence, kNonNegative, "", "lost where the evidence gives the pose a smaller chance than this");
  f("weak_evidence", o.weak_evidence, kNonNegative, "", "weak below it");
  f("given_odds", o.given_odds, kPositive, "", "odds of an object at a pose that is given, before any evidence");
  f("search_odds", o.search_odds, kPositive, "", "odds, before any evidence, that what a search without mask or box finds is the object; until a frame is ok");
  f("trust_points", o.trust_points, kPositive, "", "surface points asked for the status");
}
// clang-format on

}  // namespace sdftrack::tracking
