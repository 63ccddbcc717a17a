// SPDX-License-Identifier: MIT
// Every option of the tracker, with its default. The numbers are only here: Python reads them from this file.
#pragma once

#include "energies/sdf_energy.h"

namespace sdftrack::tracking {

enum class Collision {
  kNone,
  // n_m / K sum_k min(0, Phi_others(C_mk))^2 / (2 t^2): a squared hinge, which grows with the depth and does
  // not depend on the order of the objects.
  kContact,
  // -log(1/K sum_k H_out(Phi_before(C_mk))) of the union of the objects before m (thesis Eqs. 5.24, 5.25):
  // flat where a point is inside, so that only the points around the overlap pull, hardly against data.
  kPrinted,
};

struct TrackerOptions {
  // Residual and likelihood (docs/math/depth_tracker.md, sections 1-3)
  energies::Residual residual = energies::Residual::kRayHit;
  energies::Curvature curvature = energies::Curvature::kIrls;
  double outlier_floor = 0.1;    // e in -log((1 - e) sech^2 + e); 0: the printed likelihood
  double scale_start_m = 0.005;  // s of the first stage; halved from stage to stage; 0: no coarse stage
  double scale_per_noise = 1.0;  // s of the last stage over the sensor's noise
  // Sensor: sd of depth noise sigma(Z) = noise_m + noise_per_m * Z^2
  double noise_m = 0.001;
  double noise_per_m = 0.0;
  bool adapt_noise = true;          // rescale sigma(Z) by the residuals in every frame
  double systematic_m = 0;          // sd of the depth error that neighbours share; 0: learnt at a given pose,
  double max_systematic_m = 0.008;  // at most this
  double systematic_per_m = 0;      // grows with Z^2: systematic_m + systematic_per_m Z^2
  double lateral_px = 0;            // sd of the lateral offset of the image from the intrinsics
  double correlation_area_px = 0;   // pixels that share one error; widens the covariance; 0: measured,
  double min_correlation_area_px = 0;  // at least this
  // Pixels
  double padding_m = 0.04;  // a pixel counts when its point is this near the object's box
  int max_pixels = 10000;   // budget of the last stage
  int coarse_pixels = 320;  // budget of the coarse stages
  bool fine_first = true;   // begin without coarse stages, as finely as the motion allows
  // Second attempt, from the same start over a wider basin, when the first is not convincing
  double retry_inliers =
      0.5;  // at a start: agreeing share of the surface that nothing hides; 0: no second attempt
  double far_scale_m = 0.012;
  double far_padding_m = 0.045;
  // Optimiser
  double damping_start = 1e-3;        // 100 in the thesis
  bool stop_printed = false;          // stop at a damping above 10e6 instead of at a small predicted gain
  double coarse_floor = 0.3;          // e of the coarse stages: in front of the surface, where a hand may be;
  double coarse_floor_behind = 0.02;  // behind it, where the sensor sees nothing
  // Other energies
  bool free_space = true;
  double free_space_scale_m = 0.003;
  double free_space_weight = 1.0;  // 1: all surface points together weigh as much as the pixels do
  double motion_sigma_m = 0.03;    // weak prior about the predicted pose; 0: none
  double motion_sigma_rad = 0.3;
  bool drop_plane = false;  // leave out pixels of the dominant plane
  // Several objects (docs/math/several_objects.md)
  int carried_frames = 0;  // of an object without measurements; 0: as long as a tracked neighbour holds it
  double collision_tolerance_m = 3e-5;  // sd of the penetration depth between objects
  double union_sharpness = 40;          // of the soft minimum, per voxel, in the last stages;
  double coarse_union_sharpness = 2;    // in the coarse stages; the thesis uses it throughout
  // Colour (docs/math/color.md)
  energies::ColorLikelihood color_likelihood = energies::ColorLikelihood::kOdds;
  bool color_learning_printed = false;  // all pixels near the surface, whatever stands in front
  double color_prior = 0.7;             // P_f of an uninformative colour
  bool smooth_colors = true;       // the measurements around a pixel also contribute to its colour evidence
  bool color_free_space = false;   // a pixel without depth but with background colour is free space
  double color_max_overlap = 0.9;  // sum sqrt(p_f p_b) beyond which the colours are not used
  // Brightness of surfaces whose colours are known (docs/math/photometric.md)
  bool photometric = true;
  double photometric_weight = 0.3;  // 1: brightness has only independent noise in every pixel
  int photometric_pixels = 600;
  // Outline in the colour image (docs/math/outline.md)
  bool outline = true;
  double outline_weight = 1.0;  // 1: according to its own noise and that of the depth
  int outline_points = 120;
  int outline_reach_px = 8;        // along a line, to both sides, near the pose;
  int outline_far_px = 24;         // where the pose may be farther off
  double outline_from_m = 0.0005;  // with depth: used if its measurements share an error of this; 0: always
  bool outline_local =
      true;  // by the colours near each place of the outline, not by the whole object's alone
  // Search for a lost object
  int recover_seeds = 120;  // rotations, of 240, tried per frame: bounds the time of a frame
  // Trust
  double lost_inliers = 0.3;  // least share of the unoccluded points that must agree
  double weak_inliers = 0.55;
  double lost_evidence = 0.02;  // least probability, by the evidence, that this is the object at this pose
  double weak_evidence = 0.5;
  double given_odds = 20;     // prior odds of an object at a given pose, before any evidence
  double search_odds = 0.05;  // prior odds of the result of a search without mask or box
};

}  // namespace sdftrack::tracking
