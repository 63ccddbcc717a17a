// SPDX-License-Identifier: MIT
// What is observed of a solid: points of its surface, its outline, the table below it. Camera frame, m.
#pragma once

#include <vector>

#include "frame/region.h"

namespace sdftrack::primitives {

// What a pixel next to the object's outline shows: the object, something else, or nothing.
enum class Sight : unsigned char { kOn, kBeside, kLost };

struct OutlineRay {
  Vec3d ray;             // z = 1
  double near_m, far_m;  // depths between which the object would have been seen
  double pixel_m;        // size of a pixel at the object's depth
  Sight sight;
  double slack_m = 0;  // uncertainty of the object's end where it touches what is next to it
};

// Points in float, for loops over many at a time, relative to an origin among them: the frame's origin may be
// far away. With `rays` also the ray (z = 1) of each point.
struct FloatPoints {
  Vec3d origin{0, 0, 0};
  std::vector<float> x_m, y_m, z_m, ray_x, ray_y;

  explicit FloatPoints(const std::vector<Vec3d>& points = {}, bool rays = false) {
    if (!points.empty()) origin = points.front();
    for (const Vec3d& p : points) {
      const Vec3f d = (p - origin).cast<float>();
      x_m.push_back(d.x), y_m.push_back(d.y), z_m.push_back(d.z);
      if (!rays) continue;
      ray_x.push_back(float(p.x / p.z)), ray_y.push_back(float(p.y / p.z));
    }
  }
};

// The outline rays for such loops.
struct FloatRays {
  std::vector<float> ray_x, ray_y, near_m, far_m, pixel_m, slack_m;
  std::vector<float> side;  // 1: the object is seen; -1: something else
  std::vector<float> lost;  // 1: nothing is seen

  explicit FloatRays(const std::vector<OutlineRay>& rays = {}) {
    const auto put = [](std::vector<float>* to, double x) { to->push_back(float(x)); };
    for (const OutlineRay& r : rays) {
      put(&ray_x, r.ray.x), put(&ray_y, r.ray.y), put(&near_m, r.near_m), put(&far_m, r.far_m);
      put(&pixel_m, r.pixel_m), put(&slack_m, r.sight == Sight::kBeside ? r.slack_m : 0.0);
      put(&side, r.sight == Sight::kBeside ? -1 : 1), put(&lost, r.sight == Sight::kLost);
    }
  }
};

struct Pixel {
  int x, y;
};

struct PrimitiveView {
  std::vector<Vec3d> points;  // any first part of them is spread over the whole surface
  FloatPoints packed;         // the same points; empty: loops run point by point, in double
  std::vector<Pixel> pixels;  // pixel of each point; empty: bare points
  bool along_rays = false;    // noise is along the ray from the camera; false: in all directions
  std::vector<OutlineRay> outline;
  FloatRays packed_outline;
  bool has_plane = false;  // a plane that the solid cannot pass through
  bool stands = false;     // the solid touches the plane
  frame::Plane plane{{0, 0, 0}, 0};

  void pack() { packed = FloatPoints(points, along_rays), packed_outline = FloatRays(outline); }
};

// Without the points of a cloud that lie by themselves, far from others; the view itself where there are few
// of them, or where the measurements are those of an image.
PrimitiveView without_strays(const PrimitiveView& view);

}  // namespace sdftrack::primitives
