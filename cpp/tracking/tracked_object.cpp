// SPDX-License-Identifier: MIT
#include "tracking/tracked_object.h"

#include <cstdlib>
namespace sdftrack::tracking {

namespace {

constexpr double kOfUsual = 0.85;   // an agreeing share this far below the usual one is not convincing,
constexpr double kOfUsualHidden = 0.5;  // the same where all that is not hidden speaks for it
constexpr double kOverUsual = 1.4;  // nor is a mean cost this far above the usual one

}  // namespace

bool convincing(const Fitted& fitted, const TrackedObject& object, const TrackerOptions& options) {
  const Visibility& seen = fitted.seen;
  const bool proven = evidence_share(evidence_of(fitted, options), object.prior_log_odds) >= options.weak_evidence;
  static const int B = std::getenv("VB") ? std::atoi(std::getenv("VB")) : 1;
  static const int C = std::getenv("VC") ? std::atoi(std::getenv("VC")) : 1;
  if (object.usual_share > 0) {
    if (fitted.cost > kOverUsual * object.usual_cost) return false;
    const double share = agreeing_share(seen);
    return share >= kOfUsual * object.usual_share || (C && proven && share >= kOfUsualHidden * object.usual_share);
  }
  return seen.agree >= options.retry_inliers * (seen.agree + seen.farther) && seen.agree > 0 && (!B || proven);
}

}  // namespace sdftrack::tracking
