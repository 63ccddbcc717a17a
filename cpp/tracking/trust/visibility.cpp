// SPDX-License-Identifier: MIT
#include "tracking/trust/visibility.h"

#include <algorithm>
#include <cmath>

#include "frame/point_ops.h"

namespace sdftrack::tracking {

namespace {

constexpr double kTolerance_m = 0.004;  // least distance that counts as disagreement
constexpr double kTolerancePerNoise = 4;
constexpr double kFinger_m = 0.025;  // nearer than this in front is not clearly another thing
constexpr double kMaxGap_m = 0.03;

}  // namespace

Visibility compare_visible_surface(const frame::DepthFrame& frame, const Camera& camera,
                                   const frame::Shape& shape, const Rigidd& T_cam_obj,
                                   const DepthError& error, int points, const Neighbors& others) {
  Visibility seen;
  const double tolerance = error.tolerance(kTolerance_m, kTolerancePerNoise);
  const int n = static_cast<int>(shape.points.size()), stride = std::max(1, n / std::max(1, points));
  const frame::SightTerm<float> term{shape.sdf,
                                     shape.coarse(),
                                     T_cam_obj.cast<float>(),
                                     inverse(T_cam_obj).t.cast<float>(),
                                     static_cast<float>(shape.diameter_m),
                                     {shape.points.data(), n, stride},
                                     {shape.normals.data(), n, stride}};
  const frame::PointOps& ops = frame::point_ops_for(used_isa());
  frame::Sights sights;
  int gaps = 0;
  double gap_sum_m = 0;
  for (int first = 0; first < term.points_obj.count(); first += frame::kPointsAtOnce) {
    ops.sights(term, first, &sights);
    for (int k = 0; k < sights.count; ++k) {
      if (!(sights.facing[k] > 0)) continue;
      ++seen.expected;
      const Vec3d p_cam = Vec3f{sights.x_m[k], sights.y_m[k], sights.z_m[k]}.cast<double>();
      const double z = p_cam.z > 1e-3 ? frame::reading_at(frame, camera, p_cam) : 0;
      const double facing = sights.facing[k];
      const double beyond = (z - p_cam.z) * facing;  // about along the normal
      // A reading that is nearer to another object's surface is that object's, and hides this one.
      const bool known = !others.empty() && z > 0 && beyond < tolerance &&
                         on_one_of(others, (z / p_cam.z) * p_cam, std::min(std::abs(beyond), tolerance));
      const bool hidden = known || (z > 0 && beyond < -tolerance);
      if (z > 0 && beyond > -kFinger_m && !known) ++gaps, gap_sum_m += std::min(std::abs(beyond), kMaxGap_m);
      if (!(z > 0))
        ++seen.missing;
      else if (hidden)
        ++seen.nearer, seen.known += known;
      else if (beyond > tolerance)
        ++seen.farther;
      else
        ++seen.agree;
    }
  }
  seen.gap_m = gaps > 0 ? gap_sum_m / gaps : kMaxGap_m;
  if (error.systematic_m > 0) seen.gap_m = std::max(0.0, seen.gap_m - error.expected_gap_m());
  return seen;
}

}  // namespace sdftrack::tracking
