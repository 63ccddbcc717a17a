// SPDX-License-Identifier: MIT
// Whether the frame agrees with the pose: a status, its reason, and the probability that the pose is right.
#pragma once

#include <optional>

#include "tracking/options/options.h"
#include "tracking/trust/covariance.h"
#include "tracking/trust/outline.h"
#include "tracking/trust/reason.h"
#include "tracking/trust/visibility.h"

namespace sdftrack::tracking {

// Evidence for and against a pose; the fit has minimised none of it.
struct PoseEvidence {
  Visibility seen;
  Outline outline;
  double roughness = 1;  // residuals of the fit over the noise of measurements among themselves
  double centre_sd = 0;  // of the object's centre along its least certain axis, over its radius
  // Mean probability by colour that the visible surface is the object, less that of an uninformative colour.
  std::optional<double> color_gain;
};

struct Trust {
  Status status = Status::kOk;
  Reason reason;
  double inliers = 0;     // agree / expected
  double evidence = 0;    // evidence_share, with the prior odds
  double confidence = 0;  // probability that the pose is within 20 mm and 10 degrees

  template <class Archive, class Self>
  static void visit(Archive& archive, Self& self) {
    auto& [status, why, share, chance, right] = self;
    archive.choice(status, Status::kBadFrame);
    archive(why, share, chance, right);
  }
};

// 0..1: the probability that this is the object, about at this pose, for a pose that was expected
// (prior_log_odds 0) or one of many places that a search has examined (lower prior).
double evidence_share(const PoseEvidence& evidence, double prior_log_odds);

// The evidence as if depth were as near to the surface as that of a good sensor: what is left is where the
// surface ends and where the sensor sees through it.
PoseEvidence but_for_residuals(PoseEvidence evidence);

// vouched_log_odds: against loss, for an object that was there a moment ago or that the caller vouches for.
// That it was replaced by something similar must be more likely than an error of the sensor.
Trust judge(const PoseEvidence& evidence, const Matrix6d& covariance, const TrackerOptions& options,
            double prior_log_odds, double vouched_log_odds = 0);

}  // namespace sdftrack::tracking
