// SPDX-License-Identifier: MIT
// Whether the frame agrees with the pose: what the camera reads where the model says it should see the
// surface.
#pragma once

#include <string>

#include "tracking/covariance.h"
#include "tracking/region.h"

namespace sdftrack {

enum class Status { kOk, kWeak, kLost, kBadFrame };

// Surface points that the camera should see (facing it, not hidden by the object itself), by what is read
// there.
struct Visibility {
  int expected = 0;
  int agree = 0;    // the reading lies on the surface
  int farther = 0;  // the sensor sees past the surface: the pose is wrong there
  int nearer = 0;   // something stands in front
  int missing = 0;  // no reading, or outside the image
};

// Of the surface points that the camera should see, share that it reads where the pose puts them.
inline double agreeing_share(const Visibility& seen) {
  return seen.expected > 0 ? static_cast<double>(seen.agree) / seen.expected : 0.0;
}

Visibility compare_visible_surface(const DepthFrame& frame, const Camera& camera, const Shape& shape,
                                   const Rigidd& T_cam_obj, double noise_m, int points);

struct Trust {
  Status status = Status::kOk;
  std::string reason;
  double inliers = 0;     // agree / expected
  double confidence = 0;  // probability that the pose is within 20 mm and 10 degrees
};

// mean_cost: of the last stage, per pixel; a pixel whose reading does not fit at all costs
// -log(outlier_floor).
Trust judge(const Visibility& visible, double mean_cost, const Matrix6d& covariance,
            const TrackerOptions& options);

}  // namespace sdftrack
