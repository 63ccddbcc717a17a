// SPDX-License-Identifier: MIT
// What the camera reads where a pose says that it should see the surface.
#pragma once

#include <algorithm>

#include "frame/region.h"
#include "tracking/trust/neighbors.h"

namespace sdftrack::tracking {

// Sd of a reading's error at the object's distance: noise of its own, and what a patch of readings has in
// common (time of flight and stereo bend and shift whole surfaces).
struct DepthError {
  double noise_m;
  double systematic_m = 0;

  // A reading that is farther off than this contradicts the surface; `least_m` is where interpolation and
  // meshes end.
  double tolerance(double least_m, double per_noise) const {
    return std::max({least_m, per_noise * noise_m, kPerSystematic * systematic_m});
  }
  // Of the mean gap of readings that are on the surface, what the systematic part leaves.
  double expected_gap_m() const { return kMeanOfNormal * systematic_m; }

  static constexpr double kPerSystematic = 2.5;
  static constexpr double kMeanOfNormal = 0.8;  // of |x|, over the sd
};

// Surface points that the camera should see (facing it, not hidden by the object itself), by what is read
// there.
struct Visibility {
  int expected = 0;
  int agree = 0;    // the reading lies on the surface
  int farther = 0;  // the sensor sees past the surface: the pose is wrong there
  int nearer = 0;   // something stands in front
  int missing = 0;  // no reading, or outside the image
  // Mean distance of reading and surface, at most 30 mm each, where nothing stands more than a finger in
  // front, nor another object that is known; less what the sensor's systematic error explains.
  double gap_m = 0.03;
  int known = 0;  // of the nearer ones: another object, where it is known to be
};

// Of the surface points that the camera should see, past the objects that are known, share that it reads
// where the pose puts them.
inline double agreeing_share(const Visibility& seen) {
  const int open = seen.expected - seen.known;
  return open > 0 ? static_cast<double>(seen.agree) / open : 0.0;
}

// Surface points that the status is judged by: the standard error of the share that agrees is then below 3 %.
constexpr int kTrustPoints = 320;
constexpr int kSurfacePoints = 3 * kTrustPoints;  // of a shape, of which the camera sees a third or more

Visibility compare_visible_surface(const frame::DepthFrame& frame, const Camera& camera,
                                   const frame::Shape& shape, const Rigidd& T_cam_obj,
                                   const DepthError& error, int points, const Neighbors& others = {});

// The same by kTrustPoints, where a measurement that mixes the two sides of a depth step counts as missing,
// or by the pixels that show the surface where hardly a point of it faces the camera (a long thin object seen
// end on).
Visibility compare_visible(const frame::DepthFrame& frame, const Camera& camera, const frame::Shape& shape,
                           const Rigidd& T_cam_obj, const DepthError& error, const Neighbors& others);

}  // namespace sdftrack::tracking
