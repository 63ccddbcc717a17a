// SPDX-License-Identifier: MIT
#include "tracking/trust/outline.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "base/to_int.h"
#include "frame/point_ops.h"

namespace sdftrack::tracking {

namespace {

constexpr int kDirections = 24;
constexpr double kMargin_m = 0.006;     // beyond the silhouette; measurements nearer to it mix both sides
constexpr double kTolerance_m = 0.010;  // of a measurement that continues where the surface ends
constexpr double kTolerancePerNoise = 5;
constexpr int kMaxSteps = 12;

// The outermost surface point in a direction of the image, seen from the middle.
struct Rim {
  float radius_px = -1;
  double depth_m = 0;
};

struct Eye {
  const Camera& camera;
  Vec2d middle_px;  // of the ideal pinhole
};

std::array<Rim, kDirections> rims(const Eye& eye, const frame::Shape& shape, const Rigidd& T_cam_obj) {
  const frame::BearingTerm<float> term{T_cam_obj.cast<float>(),
                                       eye.camera.K.cast<float>(),
                                       {float(eye.middle_px.x), float(eye.middle_px.y)},
                                       {shape.points.data(), int(shape.points.size()), 1}};
  const frame::PointOps& ops = frame::point_ops_for(used_isa());
  std::array<Rim, kDirections> out;
  frame::Bearings seen;
  for (int first = 0; first < term.points_obj.count(); first += seen.count) {
    ops.bearings(term, first, &seen);
    for (int i = 0; i < seen.count; ++i) {
      const int k = std::clamp(to_int(seen.turn[i] * kDirections), 0, kDirections - 1);
      Rim& rim = out[k];
      if (seen.radius_px[i] > rim.radius_px) rim = {seen.radius_px[i], seen.depth_m[i]};
    }
  }
  return out;
}

// Walks outwards until the point at the rim's depth is the margin away from the surface.
bool step_outside(const Eye& eye, const frame::Shape& shape, const Rigidd& T_obj_cam, const Rim& rim,
                  Vec2d along, Vec2d* u) {
  const double step_px = 0.5 * kMargin_m * eye.camera.K.fx / rim.depth_m;
  double radius = rim.radius_px;
  for (int i = 0; i < kMaxSteps; ++i) {
    radius += std::max(1.0, step_px);
    *u = {eye.middle_px.x + radius * along.x, eye.middle_px.y + radius * along.y};
    const Vec3d p_cam = rim.depth_m * ray(eye.camera.K, u->x, u->y);
    float phi;
    Vec3f gradient;
    sample(shape.sdf, (T_obj_cam * p_cam).cast<float>(), &phi, &gradient);
    if (phi > kMargin_m) return true;
  }
  return false;
}

constexpr int kEnoughOutline = 6, kEnoughWithoutEnd = 4;  // directions; fewer are not sufficient

}  // namespace

bool is_part_of_something(const Outline& outline, double min_ends) {
  const int known = outline.ends + outline.runs_on;
  return known >= (outline.ends > 0 ? kEnoughOutline : kEnoughWithoutEnd) && outline.ends < min_ends * known;
}

Outline compare_outline(const frame::DepthFrame& frame, const Camera& camera, const frame::Shape& shape,
                        const Rigidd& T_cam_obj, const DepthError& error, const Neighbors& others) {
  Outline outline;
  if (!(T_cam_obj.t.z > 1e-3)) return outline;
  const Eye eye{camera, project(camera.K, T_cam_obj.t)};
  const Rigidd T_obj_cam = inverse(T_cam_obj);
  const double tolerance = error.tolerance(kTolerance_m, kTolerancePerNoise);
  const std::array<Rim, kDirections> all = rims(eye, shape, T_cam_obj);
  for (int k = 0; k < kDirections; ++k) {
    const Rim& rim = all[k];
    if (rim.radius_px < 0) continue;
    const double angle = ((k + 0.5) / kDirections - 0.5) * 2 * std::numbers::pi;
    Vec2d u;
    if (!step_outside(eye, shape, T_obj_cam, rim, {std::cos(angle), std::sin(angle)}, &u)) continue;
    const Vec3d direction = ray(camera.K, u.x, u.y);
    const double z = frame::reading_at(frame, camera, direction);
    if (!(z > 0) || z < rim.depth_m - tolerance || on_one_of(others, z * direction, tolerance))
      ++outline.unknown;
    else if (z > rim.depth_m + tolerance)
      ++outline.ends;
    else
      ++outline.runs_on;
  }
  return outline;
}

}  // namespace sdftrack::tracking
