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

inline constexpr Choice<bool> kColorLearning[] = {{false, "guarded"}, {true, "printed"}};
inline constexpr Choice<bool> kStopRules[] = {{false, "gain"}, {true, "printed"}};

// Beyond it a length, a weight or a count is a mistake.
constexpr double kOptionLimit = 1e9;
constexpr OptionRange kPositive = above(0).below(kOptionLimit);
constexpr OptionRange kNonNegative = at_least(0).below(kOptionLimit);

// clang-format off
template <OptionsOf<TrackerOptions> Options, class Visit>
void visit_options(Options& o, Visit& f) {
  f("residual", o.residual, Choices<energies::Residual>(kResiduals), "", "ray_hit: depth where the ray intersects the model minus measured depth; slope; point: as printed (Eq. 3.11)");
  f("curvature", o.curvature, Choices<energies::Curvature>(kCurvatures), "", "irls, or printed: J^T J of the log-likelihood's gradient (Eq. 3.18)");
  f("outlier_floor", o.outlier_floor, at_least(0).below(1), "", "outlier fraction of the likelihood; 0: as printed");
  f("scale_start_m", o.scale_start_m, kNonNegative, "m", "scale s of the first coarse stage, halved from stage to stage; 0: no coarse stages");
  f("scale_per_noise", o.scale_per_noise, kPositive, "", "scale s of the last stage, relative to the sensor noise");
  f("noise_m", o.noise_m, kPositive, "m", "sensor noise: sigma(Z) = noise_m + noise_per_m Z^2");
  f("noise_per_m", o.noise_per_m, kNonNegative, "1/m", "see noise_m");
  f("adapt_noise", o.adapt_noise, kTrueOrFalse, "", "rescale sigma(Z) in every frame by the residuals");
  f("systematic_m", o.systematic_m, kNonNegative, "m", "sd of the depth error shared by neighbouring pixels (stereo, time of flight); 0: estimated at a given pose");
  f("max_systematic_m", o.max_systematic_m, kNonNegative, "m", "upper bound of the estimated systematic_m; 0: the sensor has no such error");
  f("systematic_per_m", o.systematic_per_m, kNonNegative, "1/m", "the systematic error grows with distance: systematic_m + systematic_per_m Z^2");
  f("lateral_px", o.lateral_px, kNonNegative, "px", "standard deviation of the lateral offset of the depth image from its intrinsics; widens the covariance");
  f("correlation_area_px", o.correlation_area_px, kNonNegative, "px", "number of pixels that share one error; widens the covariance; 0: estimated");
  f("min_correlation_area_px", o.min_correlation_area_px, kNonNegative, "px", "lower bound of the estimated correlation_area_px");
  f("padding_m", o.padding_m, kNonNegative, "m", "pixels within this distance of the object's bounding box at its last pose are used");
  f("retry_inliers", o.retry_inliers, kNonNegative, "", "at a start: a wider second attempt is made if the inlier fraction is below this; 0: never");
  f("far_scale_m", o.far_scale_m, kNonNegative, "m", "scale_start_m of the second attempt");
  f("far_padding_m", o.far_padding_m, kNonNegative, "m", "padding_m of the second attempt");
  f("max_pixels", o.max_pixels, kPositive, "", "maximum number of pixels in the last stage");
  f("coarse_pixels", o.coarse_pixels, kPositive, "", "maximum number of pixels in the coarse stages");
  f("fine_first", o.fine_first, kTrueOrFalse, "", "start each frame without coarse stages, in which a hand holding the object would pull the pose along");
  f("damping_start", o.damping_start, kNonNegative, "", "initial Levenberg-Marquardt damping (100 in the thesis)");
  f("stop_rule", o.stop_printed, Choices<bool>(kStopRules), "", "gain: a stage ends once the predicted decrease is small; printed: once the damping exceeds 10e6 (Table 3.2)");
  f("coarse_floor", o.coarse_floor, at_least(0).below(1), "", "outlier_floor of the coarse stages for measurements in front of the surface");
  f("coarse_floor_behind", o.coarse_floor_behind, at_least(0).below(1), "", "outlier_floor of the coarse stages for measurements behind the surface, where no occluder can be");
  f("free_space", o.free_space, kTrueOrFalse, "", "penalise model points in space that the sensor observes to be free");
  f("free_space_scale_m", o.free_space_scale_m, kPositive, "m", "scale s of the free-space term");
  f("free_space_weight", o.free_space_weight, kNonNegative, "", "weight of the free-space term; 1: all its surface points together weigh as much as all pixels");
  f("motion_sigma_m", o.motion_sigma_m, kNonNegative, "m", "standard deviation of the weak prior on the translation, centred at the predicted pose; 0: no prior");
  f("motion_sigma_rad", o.motion_sigma_rad, kNonNegative, "rad", "standard deviation of the same prior on the rotation");
  f("drop_plane", o.drop_plane, kTrueOrFalse, "", "ignore the pixels of the dominant plane (a table)");
  f("carried_frames", o.carried_frames, kNonNegative, "frames", "an object without measurements of its own is placed by its neighbours for at most this many frames; 0: for 5, and as long as tracked neighbours hold it");
  f("collision_tolerance_m", o.collision_tolerance_m, kPositive, "m", "standard deviation of the penetration depth between objects");
  f("union_sharpness", o.union_sharpness, kPositive, "", "sharpness of the soft minimum over several objects, per voxel, in the last stages");
  f("coarse_union_sharpness", o.coarse_union_sharpness, kPositive, "", "sharpness of the soft minimum in the coarse stages; 2 in the thesis (section 5.2)");
  f("color_likelihood", o.color_likelihood, Choices<energies::ColorLikelihood>(kColorLikelihoods), "", "odds: the colour sets each pixel's outlier fraction; printed: P_f d_on + P_b H_out (Eq. 4.18)");
  f("color_learning", o.color_learning_printed, Choices<bool>(kColorLearning), "", "guarded: pixels are weighted by their colour, and colours of what stands in front are removed; printed: all within 3 voxels of the surface (Eq. 4.22)");
  f("color_prior", o.color_prior, above(0).below(1), "", "foreground posterior of an uninformative colour");
  f("smooth_colors", o.smooth_colors, kTrueOrFalse, "", "combine the colour evidence of a pixel with that of its neighbours on the same surface");
  f("color_free_space", o.color_free_space, kTrueOrFalse, "", "treat a pixel without depth but with background colour as free space");
  f("color_max_overlap", o.color_max_overlap, kNonNegative, "", "mode auto: depth alone if the overlap of the histograms, sum sqrt(p_f p_b), exceeds this");
  f("photometric", o.photometric, kTrueOrFalse, "", "with a coloured shape and colour images: add a photometric term to the pose estimation");
  f("photometric_weight", o.photometric_weight, kPositive, "", "weight of the photometric term; 1: according to its noise alone");
  f("photometric_pixels", o.photometric_pixels, kPositive, "", "number of pixels in the photometric term");
  f("outline", o.outline, kTrueOrFalse, "", "with colour images: use the object's outline (occluding contour) too; the only term in frames without depth");
  f("outline_weight", o.outline_weight, kPositive, "", "weight of the outline term; 1: according to its noise and that of the depth alone");
  f("outline_points", o.outline_points, from_to(20, 2000), "", "number of points on the outline in the outline term");
  f("outline_reach_px", o.outline_reach_px, from_to(4, 64), "px", "search distance on either side of the outline, near the pose");
  f("outline_far_px", o.outline_far_px, from_to(4, 64), "px", "search distance on either side of the outline when the pose may be farther off");
  f("outline_from_m", o.outline_from_m, kNonNegative, "m", "with depth, use the outline only if the depth measurements share an error of at least this; 0: always");
  f("outline_local", o.outline_local, kTrueOrFalse, "", "learn the colours along the outline locally; False: those of the whole object and its whole surroundings");
  f("recover_seeds", o.recover_seeds, kPositive, "", "rotations, of 240, that a search for a lost object tries per frame; bounds its time");
  f("lost_inliers", o.lost_inliers, kNonNegative, "", "lost if the inlier fraction among unoccluded surface points is below this");
  f("weak_inliers", o.weak_inliers, kNonNegative, "", "weak if that inlier fraction is below this");
  f("lost_evidence", o.lost_evidence, kNonNegative, "", "lost if the posterior probability of the pose is below this");
  f("weak_evidence", o.weak_evidence, kNonNegative, "", "weak if the posterior probability of the pose is below this");
  f("given_odds", o.given_odds, kPositive, "", "prior odds that the object is present at a given pose");
  f("search_odds", o.search_odds, kPositive, "", "prior odds that the result of a search without mask or box is the object; applies until a frame is ok");
}
// clang-format on

}  // namespace sdftrack::tracking
