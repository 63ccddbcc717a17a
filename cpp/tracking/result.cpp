// SPDX-License-Identifier: MIT
#include "tracking/result.h"

#include <utility>

namespace sdftrack::tracking {

ObjectResult result_without_pose(const TrackedObject& object, Reason reason, Status status) {
  ObjectResult result;
  result.T_cam_obj = uncentred(object.T_cam_obj, *object.shape);
  result.covariance.setConstant(kUnknown);
  result.runner_up = kUnknown;
  result.trust = {status, std::move(reason), 0, 0, 0};
  return result;
}

}  // namespace sdftrack::tracking
