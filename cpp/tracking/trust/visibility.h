// SPDX-License-Identifier: MIT
// What the camera measures where a pose predicts visible surface.
#pragma once

#include <algorithm>

#include "frame/region.h"
#include "tracking/trust/neighbors.h"

namespace sdftrack::tracking {

// Sd of a depth error at the object's distance: independent noise, and the part that a patch of measurements
// shares (time of flight and stereo bend and shift whole surfaces).
struct DepthError {
  double noise_m;
  double systematic_m = 0;

  // A measurement farther off contradicts the surface; `least_m`: limit of interpolation and meshes.
  double tolerance(double least_m, double per_noise) const {
    return std::max({least_m, per_noise * noise_m, kPerSystematic * systematic_m});
  }
  // The share of the mean gap on the surface that the systematic error causes.
  double expected_gap_m() const { return kMeanOfNormal * systematic_m; }

  static constexpr double kPerSystematic = 2.5;
  static constexpr double kMeanOfNormal = 0.8;  // of |x|, over the sd
};

// Surface points that the camera should see (facing it, not self-hidden), by the measurement there.
struct Visibility {
  int expected = 0;
  int agree = 0;    // the measurement lies on the surface
  int farther = 0;  // the sensor sees past the surface: the pose is wrong there
  int nearer = 0;   // something stands in front
  int missing = 0;  // no measurement, or outside the image
  // Mean distance of measurement and surface, at most 30 mm each, where neither anything more than a finger
  // in front nor another known object hides it; less what the sensor's systematic error explains.
  double gap_m = 0.03;
  int known = 0;  // of the nearer ones: another object at its known pose
};

// Of the surface points to be seen that no known object hides, the share measured as predicted.
inline double agreeing_share(const Visibility& seen) {
  const int open = seen.expected - seen.known;
  return open > 0 ? double(seen.agree) / open : 0.0;
}

// Surface points for the status: the standard error of the share that agrees is then below 3 %.
constexpr int kTrustPoints = 320;
constexpr int kSurfacePoints = 3 * kTrustPoints;  // of a shape, of which the camera sees a third or more

Visibility compare_visible_surface(const frame::DepthFrame& frame, const Camera& camera,
                                   const frame::Shape& shape, const Rigidd& T_cam_obj,
                                   const DepthError& error, int points, const Neighbors& others = {});

// The same with kTrustPoints, where a measurement that mixes the sides of a depth step counts as missing; or
// by pixels where hardly any point faces the camera (a long thin object seen end on).
Visibility compare_visible(const frame::DepthFrame& frame, const Camera& camera, const frame::Shape& shape,
                           const Rigidd& T_cam_obj, const DepthError& error, const Neighbors& others);

}  // namespace sdftrack::tracking
