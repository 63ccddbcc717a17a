// SPDX-License-Identifier: MIT
// The tracker's options: their one list, from which Python makes its dataclass and its TOML.
#include "array.h"
#include "tracking/options.h"

namespace sdftrack {

void bind_tracker_options(py::module_& m) {
  py::class_<TrackerOptions> options(m, "TrackerOptions",
                                     "Options of the tracker; see sdftrack.TrackerOptions.");
  options.def(py::init<>());
#define SDFTRACK_OPTION(name) options.def_readwrite(#name, &TrackerOptions::name)
  SDFTRACK_OPTION(residual);
  SDFTRACK_OPTION(curvature);
  SDFTRACK_OPTION(outlier_floor);
  SDFTRACK_OPTION(scale_start_m);
  SDFTRACK_OPTION(scale_per_noise);
  SDFTRACK_OPTION(noise_m);
  SDFTRACK_OPTION(noise_per_m);
  SDFTRACK_OPTION(adapt_noise);
  SDFTRACK_OPTION(correlation_area_px);
  SDFTRACK_OPTION(padding_m);
  SDFTRACK_OPTION(retry_inliers);
  SDFTRACK_OPTION(far_scale_m);
  SDFTRACK_OPTION(far_padding_m);
  SDFTRACK_OPTION(max_pixels);
  SDFTRACK_OPTION(coarse_pixels);
  SDFTRACK_OPTION(min_pixels);
  SDFTRACK_OPTION(damping_start);
  SDFTRACK_OPTION(keep_damping);
  SDFTRACK_OPTION(coarse_floor);
  SDFTRACK_OPTION(coarse_floor_behind);
  SDFTRACK_OPTION(coarse_steps);
  SDFTRACK_OPTION(fine_steps);
  SDFTRACK_OPTION(free_space);
  SDFTRACK_OPTION(free_space_scale_m);
  SDFTRACK_OPTION(free_space_weight);
  SDFTRACK_OPTION(free_space_points);
  SDFTRACK_OPTION(photometric);
  SDFTRACK_OPTION(photometric_sigma);
  SDFTRACK_OPTION(photometric_weight);
  SDFTRACK_OPTION(photometric_pixels);
  SDFTRACK_OPTION(motion_sigma_m);
  SDFTRACK_OPTION(motion_sigma_rad);
  SDFTRACK_OPTION(drop_plane);
  SDFTRACK_OPTION(collision_tolerance_m);
  SDFTRACK_OPTION(union_sharpness);
  SDFTRACK_OPTION(coarse_union_sharpness);
  SDFTRACK_OPTION(color_likelihood);
  SDFTRACK_OPTION(color_prior);
  SDFTRACK_OPTION(color_object_rate);
  SDFTRACK_OPTION(color_background_rate);
  SDFTRACK_OPTION(color_free_space);
  SDFTRACK_OPTION(color_max_overlap);
  SDFTRACK_OPTION(recover_seeds);
  SDFTRACK_OPTION(lost_inliers);
  SDFTRACK_OPTION(weak_inliers);
  SDFTRACK_OPTION(lost_evidence);
  SDFTRACK_OPTION(weak_evidence);
  SDFTRACK_OPTION(search_odds);
  SDFTRACK_OPTION(trust_points);
#undef SDFTRACK_OPTION
}

}  // namespace sdftrack
