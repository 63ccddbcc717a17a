// SPDX-License-Identifier: MIT
#include "tracking/trust/trust.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "base/portable_math.h"
#include "base/to_int.h"

namespace sdftrack::tracking {

namespace {

constexpr double kFarPose_m = 0.020, kFarPose_rad = 10 * std::numbers::pi / 180;
constexpr double kRead = 0.25;  // weak: a smaller share of the visible surface is measured on the object
constexpr double kReadWidth = 0.03;
constexpr double kHardlyRead = 0.05;
constexpr int kFewEnds = 3;  // directions in which the object is seen to end
constexpr double kGoodGap_m = 0.001;
constexpr int kEnough = 6;  // agreeing points; fewer are not sufficient

// Logistic regression over poses with known error: true poses, disturbed ones, and those where a fit diverged
// or was made to another object (python -m experiments run trust.fit; docs/trust.md).
struct Weights {
  double constant = -25.97;
  double log_gap = -1.22;   // of the mean gap in mm, plus 0.5
  double unhidden = 29.29;  // agree / (agree + farther)
  double log_ends = 0.87;   // odds that the surface ends where the outline does
  double missing = -4.22;   // share of the points without depth
  double log_rough = -1.55;
  double color = 8.0;
};
constexpr Weights kWeights;

int percent(double share) { return to_int(std::round(100 * share)); }

double ratio(int part, int whole) { return whole > 0 ? double(part) / whole : 0.0; }

// (a + 1) / (a + b + 2): a share that is 1/2 where nothing is known.
double share(int a, int b) { return (a + 1.0) / (a + b + 2.0); }

double rise(double x) { return 1 / (1 + std::exp(-x)); }

double within(double limit, double variance) { return error_function(limit / std::sqrt(2 * variance)); }

// The reason that weighs most against a pose without a plain fault.
Reason doubt(const PoseEvidence& e) {
  const Outline& o = e.outline;
  if (e.color_gain && *e.color_gain < 0) return {ReasonCode::kWrongColors};
  if (o.runs_on > o.ends) return {ReasonCode::kRunsOn};
  if (e.seen.missing > e.seen.agree) return {ReasonCode::kMissingReadings};
  return {ReasonCode::kPoorFit};
}

}  // namespace

double evidence_share(const PoseEvidence& e, double prior_log_odds) {
  const Visibility& seen = e.seen;
  const Weights& w = kWeights;
  const double ends = share(e.outline.ends, e.outline.runs_on);
  double score = prior_log_odds + w.constant + w.log_gap * std::log(1e3 * seen.gap_m + 0.5) +
                 w.unhidden * share(seen.agree, seen.farther) + w.log_ends * std::log(ends / (1 - ends)) +
                 w.missing * ratio(seen.missing, seen.expected) +
                 w.log_rough * std::log(std::clamp(e.roughness, 0.5, 20.0));
  if (e.color_gain) score += w.color * *e.color_gain;
  return rise(score);
}

PoseEvidence but_for_residuals(PoseEvidence evidence) {
  evidence.seen.gap_m = std::min(evidence.seen.gap_m, kGoodGap_m);
  evidence.roughness = std::min(evidence.roughness, 1.0);
  return evidence;
}

Trust judge(const PoseEvidence& evidence, const Matrix6d& covariance, const TrackerOptions& options,
            double prior_log_odds, double vouched_log_odds) {
  const Visibility& seen = evidence.seen;
  Trust trust;
  trust.inliers = ratio(seen.agree, seen.expected);
  const double unhidden = ratio(seen.agree, seen.agree + seen.farther);
  const double read = ratio(seen.agree, seen.agree + seen.farther + seen.nearer);
  double belief = trust.evidence = evidence_share(evidence, prior_log_odds);
  if (seen.agree < kEnough || unhidden < options.lost_inliers || read < kHardlyRead) {
    trust.status = Status::kLost;
    trust.reason = reason_with_percent(ReasonCode::kLittleVisible, percent(read));
  } else if (evidence_share(evidence, prior_log_odds + vouched_log_odds) < options.lost_evidence) {
    trust.status = Status::kLost;
    trust.reason = doubt(evidence);
  } else if (unhidden < options.weak_inliers || read < kRead) {
    trust.status = Status::kWeak;
    trust.reason = seen.nearer > seen.farther
                       ? reason_with_percent(ReasonCode::kHidden, percent(ratio(seen.nearer, seen.expected)))
                       : reason_with_percent(ReasonCode::kSeenPast, percent(1 - unhidden));
  } else if (belief < options.weak_evidence) {
    trust.status = Status::kWeak;
    trust.reason = doubt(evidence);
  } else if (is_part_of_something(evidence.outline)) {
    trust.status = Status::kWeak;
    trust.reason = doubt(evidence);
    belief = std::min(belief, options.weak_evidence);
  } else if (evidence.centre_sd > 1 && evidence.outline.ends < kFewEnds) {
    trust.status = Status::kWeak;
    trust.reason = {ReasonCode::kOpenPosition};
  }
  if (trust.status == Status::kLost) return trust;
  // That this is the object at this pose, that enough of it is measured, that the remaining error is small.
  trust.confidence = belief * rise((read - kRead) / kReadWidth) *
                     within(kFarPose_m, covariance.diagonal().head<3>().maxCoeff()) *
                     within(kFarPose_rad, covariance.diagonal().tail<3>().maxCoeff());
  return trust;
}

}  // namespace sdftrack::tracking
