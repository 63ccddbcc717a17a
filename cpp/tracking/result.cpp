// SPDX-License-Identifier: MIT
#include "tracking/result.h"

#include <cmath>
#include <utility>

namespace sdftrack::tracking {

bool is_finite(const ObjectResult& result) {
  const auto finite = [](Vec3d v) { return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z); };
  const Rigidd& T = result.T_cam_obj;
  return finite(T.R.r0) && finite(T.R.r1) && finite(T.R.r2) && finite(T.t) && result.covariance.allFinite() &&
         std::isfinite(result.trust.confidence) && std::isfinite(result.trust.evidence);
}

ObjectResult result_without_pose(const TrackedObject& object, Reason reason, Status status) {
  ObjectResult result;
  result.T_cam_obj = uncentred(object.T_cam_obj, *object.shape);
  result.covariance.setConstant(kUnknown);
  result.runner_up = kUnknown;
  result.trust = {status, std::move(reason), 0, 0, 0};
  return result;
}

}  // namespace sdftrack::tracking
