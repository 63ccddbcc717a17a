// SPDX-License-Identifier: MIT
#include "calibration/ball/ball_filter.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace sdftrack::calibration {

namespace {

constexpr double kNearest_m = 0.1, kMinRadiusInDepth_px = 4;
constexpr double kInnerRings[] = {0.35, 0.62, 0.8};  // of the radius
constexpr int kOnInner = 8, kOnOuter = 16;           // points
constexpr int kStride = 4;

class Filter {
 public:
  Filter(const ImageView<float>& smooth, double radius_m) : smooth_(smooth), radius_m_(radius_m) {
    for (const Vec2d d : directions(kOnOuter, 0)) outer_.push_back({kOuterRing * d.x, kOuterRing * d.y});
    // Points far apart come first: most of an image shows continuous surfaces, which four points reject.
    std::stable_sort(outer_.begin(), outer_.end(), [](Vec2d a, Vec2d b) { return on_axis(a) > on_axis(b); });
    for (const double rho : kInnerRings)
      for (const Vec2d d : directions(kOnInner, rho))
        inner_.push_back({{rho * d.x, rho * d.y}, radius_m * (1 - std::sqrt(1 - rho * rho))});
  }

  // Share of the outer ring that lies behind; 0 if none of the first four points does.
  double free(const NearestPoint& p) const {
    int count = 0;
    for (std::size_t k = 0; k < outer_.size() && (k != 4 || count > 0); ++k) {
      const double at = around(p, outer_[k]);
      count += at <= 0 || at > p.z + radius_m_;
    }
    return double(count) / kOnOuter;
  }
  // Share of the inner rings whose depth matches a sphere.
  double good(const NearestPoint& p) const {
    const double tolerance = 0.006 + 0.004 * p.z * p.z;  // noise of both points, at 3 sd of a Kinect
    int count = 0;
    for (const Inner& point : inner_) {
      const double at = around(p, point.at);
      count += at > 0 && std::abs(at - p.z - point.behind_m) < tolerance;
    }
    return double(count) / double(inner_.size());
  }

 private:
  struct Inner {
    Vec2d at;
    double behind_m;
  };
  static bool on_axis(Vec2d d) { return std::min(std::abs(d.x), std::abs(d.y)) < 1e-9; }
  double around(const NearestPoint& p, Vec2d d) const {
    return depth_at(smooth_, p.u + p.radius_px * d.x, p.v + p.radius_px * d.y);
  }

  const ImageView<float>& smooth_;
  const double radius_m_;
  std::vector<Vec2d> outer_;
  std::vector<Inner> inner_;
};

}  // namespace

std::vector<Vec2d> directions(int count, double start) {
  std::vector<Vec2d> out;
  for (int k = 0; k < count; ++k) {
    const double t = 2 * std::numbers::pi * (k + start) / count;
    out.push_back({std::cos(t), std::sin(t)});
  }
  return out;
}

std::vector<NearestPoint> nearest_points(const ImageView<float>& smooth, const Camera& camera,
                                         double radius_m) {
  const Filter filter(smooth, radius_m);
  const double focal = 0.5 * (camera.K.fx + camera.K.fy);
  std::vector<NearestPoint> out;
  for (int v = 2; v < smooth.height; v += kStride)
    for (int u = 2; u < smooth.width; u += kStride) {
      const auto z = double(smooth(u, v));
      if (!(z > kNearest_m && z < kFarthest_m)) continue;
      NearestPoint p{u, v, z, focal * radius_m / (z + radius_m), 0};
      if (p.radius_px <= kMinRadiusInDepth_px) continue;
      const double free = filter.free(p);
      if (free <= kMinFree) continue;
      const double good = filter.good(p);
      if (good <= kMinShare) continue;
      p.score = good + 0.5 * free;
      out.push_back(p);
    }
  return out;
}

}  // namespace sdftrack::calibration
