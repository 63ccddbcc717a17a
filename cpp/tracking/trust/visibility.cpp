// SPDX-License-Identifier: MIT
#include "tracking/trust/visibility.h"

#include <array>
#include <cmath>

#include "base/to_int.h"
#include "frame/point_ops.h"
#include "render/sdf_ray.h"

namespace sdftrack::tracking {

namespace {

constexpr double kMisfit_m = 0.004;  // least distance that counts as disagreement
constexpr double kMisfitPerNoise = 4;
constexpr double kFinger_m = 0.025;  // nearer in front than this is not clearly another object
constexpr double kMaxGap_m = 0.03;
// When a long thin object is seen end on, hardly any surface point faces the camera. With fewer points than
// this, the pixels that show the object are judged instead.
constexpr int kMinExpected = 40;
constexpr double kMaxRays = 4000;
// Depth is blurred this far from a depth step; between, the surface may slope as where it is seen under this
// cosine. A visible surface that slopes that much must end at a step of this height.
constexpr int kStep_px = 3;
constexpr double kMinFacing = 0.2, kDepthStep_m = 0.03;

// Whether the depth rises through a pixel from one side to the other by `least_m` on either side.
bool is_on_ramp(const ImageView<float>& depth_m, int x, int y, double least_m) {
  if (x < 1 || y < 1 || x + 1 >= depth_m.width || y + 1 >= depth_m.height) return false;
  const double z = depth_m(x, y);
  for (const auto& [dx, dy] : {std::array{1, 0}, {0, 1}, {1, 1}, {1, -1}}) {
    const double a = depth_m(x - dx, y - dy), b = depth_m(x + dx, y + dy);
    if (std::min(a, b) > 0 && std::min(a, b) < z - least_m && std::max(a, b) > z + least_m) return true;
  }
  return false;
}

// Whether the measurement z at p, a surface point seen under the cosine `facing`, lies between the surface
// and the depth beyond its edge, as time-of-flight cameras measure at a step: it belongs to neither.
bool mixes_two_depths(const frame::DepthFrame& frame, const Camera& camera, const Vec3d& p_cam, double facing,
                      double z, double margin_m) {
  const Vec2d px = camera.project_point(p_cam);
  const int u = to_int(px.x + 0.5), v = to_int(px.y + 0.5);
  const double least = std::clamp(facing, kMinFacing, 1.0), steepness = std::sqrt(1 - least * least) / least;
  const double slope_m = kStep_px * p_cam.z / camera.K.fx * steepness;
  bool on_surface = false, on_slope = false;
  double farthest = 0;
  for (const int dy : {-kStep_px, 0, kStep_px})
    for (const int dx : {-kStep_px, 0, kStep_px}) {
      const int x = u + dx, y = v + dy;
      if (x < 0 || y < 0 || x >= camera.width || y >= camera.height) continue;
      const double beside = frame.depth_m(x, y), off = std::abs(beside - p_cam.z);
      on_surface |= off < margin_m;
      on_slope |= off < margin_m + slope_m;
      farthest = std::max(farthest, beside);
    }
  if (!(farthest > z + margin_m)) return false;
  return on_surface ||
         (on_slope && farthest > p_cam.z + kDepthStep_m && is_on_ramp(frame.depth_m, u, v, margin_m));
}

// Counts the measurements where the camera should see a point of the surface.
class Count {
 public:
  Count(const frame::DepthFrame& frame, const Camera& camera, const DepthError& error,
        const Neighbors& others, bool excuse_steps)
      : frame_(frame),
        camera_(camera),
        error_(error),
        others_(others),
        excuse_steps_(excuse_steps),
        tolerance_m_(error.tolerance(kMisfit_m, kMisfitPerNoise)) {}

  // facing: cosine of the incidence.
  void add(const Vec3d& p_cam, double facing) {
    ++seen_.expected;
    const double z = p_cam.z > 1e-3 ? frame::reading_at(frame_, camera_, p_cam) : 0;
    const double beyond = (z - p_cam.z) * facing;  // about along the normal
    // A measurement nearer to another object's surface belongs to that object, which hides this one.
    const bool known = !others_.empty() && z > 0 && beyond < tolerance_m_ &&
                       on_one_of(others_, (z / p_cam.z) * p_cam, std::min(std::abs(beyond), tolerance_m_));
    if (excuse_steps_ && beyond > tolerance_m_ &&
        mixes_two_depths(frame_, camera_, p_cam, facing, z, tolerance_m_)) {
      ++seen_.missing;
      return;
    }
    const bool hidden = known || (z > 0 && beyond < -tolerance_m_);
    if (z > 0 && beyond > -kFinger_m && !known) ++gaps_, gap_sum_m_ += std::min(std::abs(beyond), kMaxGap_m);
    if (!(z > 0))
      ++seen_.missing;
    else if (hidden)
      ++seen_.nearer, seen_.known += known;
    else if (beyond > tolerance_m_)
      ++seen_.farther;
    else
      ++seen_.agree;
  }

  Visibility result() const {
    Visibility seen = seen_;
    seen.gap_m = gaps_ > 0 ? gap_sum_m_ / gaps_ : kMaxGap_m;
    if (error_.systematic_m > 0) seen.gap_m = std::max(0.0, seen.gap_m - error_.expected_gap_m());
    return seen;
  }

 private:
  const frame::DepthFrame& frame_;
  const Camera& camera_;
  const DepthError& error_;
  const Neighbors& others_;
  bool excuse_steps_;
  double tolerance_m_;
  Visibility seen_;
  int gaps_ = 0;
  double gap_sum_m_ = 0;
};

Visibility compare_visible_pixels(const Camera& camera, const frame::Shape& shape, const Rigidd& T_cam_obj,
                                  Count count) {
  const frame::Rect box = frame::projected_box(camera, shape, T_cam_obj, 0);
  const render::SdfRays rays(shape.sdf, camera, T_cam_obj);
  const double area = double(box.x1 - box.x0) * (box.y1 - box.y0);
  const int stride = std::max(1, to_int(std::ceil(std::sqrt(area / kMaxRays))));
  for (int v = box.y0; v < box.y1; v += stride)
    for (int u = box.x0; u < box.x1; u += stride) {
      const render::Hit hit = rays.trace(u, v);
      if (!(hit.depth_m > 0)) continue;
      const Vec3d p_cam = double(hit.depth_m) * rays.lens.at(u, v);
      const double facing = -dot(hit.normal_cam.cast<double>(), p_cam) / norm(p_cam);
      if (facing > 0) count.add(p_cam, facing);
    }
  return count.result();
}

Visibility compare_points(const frame::Shape& shape, const Rigidd& T_cam_obj, int points, Count count) {
  const int n = int(shape.points.size()), stride = std::max(1, n / std::max(1, points));
  const frame::SightTerm<float> term{shape.sdf,
                                     shape.coarse(),
                                     T_cam_obj.cast<float>(),
                                     inverse(T_cam_obj).t.cast<float>(),
                                     float(shape.diameter_m),
                                     {shape.points.data(), n, stride},
                                     {shape.normals.data(), n, stride}};
  const frame::PointOps& ops = frame::point_ops_for(used_isa());
  frame::Sights sights;
  for (int first = 0; first < term.points_obj.count(); first += frame::kPointsAtOnce) {
    ops.sights(term, first, &sights);
    for (int k = 0; k < sights.count; ++k)
      if (sights.facing[k] > 0)
        count.add(Vec3f{sights.x_m[k], sights.y_m[k], sights.z_m[k]}.cast<double>(), sights.facing[k]);
  }
  return count.result();
}

}  // namespace

Visibility compare_visible_surface(const frame::DepthFrame& frame, const Camera& camera,
                                   const frame::Shape& shape, const Rigidd& T_cam_obj,
                                   const DepthError& error, int points, const Neighbors& others) {
  return compare_points(shape, T_cam_obj, points, Count(frame, camera, error, others, false));
}

Visibility compare_visible(const frame::DepthFrame& frame, const Camera& camera, const frame::Shape& shape,
                           const Rigidd& T_cam_obj, const DepthError& error, const Neighbors& others) {
  // The known part of a growing shape ends anywhere, not at depth steps.
  const Count count(frame, camera, error, others, !shape.seen.amount);
  const Visibility seen = compare_points(shape, T_cam_obj, kTrustPoints, count);
  if (seen.expected >= kMinExpected || shape.seen.amount || !(T_cam_obj.t.z > 0)) return seen;
  const Visibility by_pixels = compare_visible_pixels(camera, shape, T_cam_obj, count);
  return by_pixels.expected > seen.expected ? by_pixels : seen;
}

}  // namespace sdftrack::tracking
