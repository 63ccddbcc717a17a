// SPDX-License-Identifier: MIT
#include "tracking/fit/contour_points.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "base/portable_math.h"
#include "base/to_int.h"
#include "frame/passage.h"
#include "frame/point_ops.h"

namespace sdftrack::tracking {

namespace {

constexpr int kDirections = 96;  // of the rim from which the hull is made
// Of a ray from the surface, in voxels: nearer, the volume rounds edges; farther, the foot is less exact.
constexpr double kNear = 1.0, kWanted = 2.5, kFar = 4.5;
constexpr int kTries = 5, kSecant = 4;
constexpr double kTangent = 0.15;  // |cosine| of a ray on the normal at its foot, at most

using Ray = frame::ObjectRay;
using frame::Passage;

class Contour {
 public:
  Contour(const Intrinsics<double>& K, const frame::Shape& shape, const Rigidd& T_cam_obj)
      : K_(K),
        shape_(shape),
        coarse_(shape.coarse()),
        T_obj_cam_(inverse(T_cam_obj)),
        T_cam_obj_(T_cam_obj),
        voxel_(double(shape.sdf.voxel_m)) {}

  Ray ray_of(Vec2d u) const { return frame::object_ray(K_, T_obj_cam_, u); }
  Passage pass(const Ray& ray) const { return frame::pass(shape_, coarse_, ray); }

  // The foot of the shortest line from the ray to the surface, near where the ray passes. False where the ray
  // enters the surface, or where no such place is found.
  bool foot(const Ray& ray, const Passage& passage, ContourPoint* point, double* phi) const {
    const double length = norm(ray.along);
    const auto slope = [&](double t, double* value, Vec3d* gradient) {
      sample(shape_.sdf, ray.at(t), value, gradient);
      return dot(*gradient, ray.along) / length;
    };
    double t = passage.t, value;
    Vec3d g;
    double s = slope(t, &value, &g);
    double step = (s > 0 ? -1.5 : 1.5) * voxel_ / length;
    double other_t = t, other_s = s;
    for (int k = 0; k < kSecant && std::abs(s) > 0.5 * kTangent; ++k) {
      if (other_s * s < 0)
        step = -s * (t - other_t) / (s - other_s);
      else if (k > 0)
        step = (s > 0 ? -1.5 : 1.5) * voxel_ / length;
      const double next = t + step;
      double next_value;
      Vec3d next_g;
      const double next_s = slope(next, &next_value, &next_g);
      if (next_s * s < 0) other_t = t, other_s = s;
      t = next, s = next_s, value = next_value, g = next_g;
    }
    *phi = value;
    const double size = norm(g);
    if (!(value > 0) || !(size > 0.5) || !(std::abs(s) < kTangent * size)) return false;
    const Vec3d n = (1 / size) * g;
    *point = {ray.at(t) - value * n, n};
    return true;
  }

  // Moves from a pixel outside to a contour point; `outwards` there.
  bool settle(Vec2d u, Vec2d outwards, ContourPoint* point) const {
    for (int k = 0; k < kTries; ++k) {
      const Ray ray = ray_of(u);
      const Passage passage = pass(ray);
      const double per_px = std::max(1e-3, passage.t) / K_.fx;
      double phi = 0;
      if (passage.hit || !foot(ray, passage, point, &phi)) {
        const double by = kWanted * voxel_ / per_px;
        u = {u.x + by * outwards.x, u.y + by * outwards.y};
        continue;
      }
      if (phi >= kNear * voxel_ && phi <= kFar * voxel_) return true;
      const Vec2d n = image_normal(point->n_obj);
      const double by = (phi - kWanted * voxel_) / per_px;
      u = {u.x - by * n.x, u.y - by * n.y};
      outwards = n;
    }
    return false;
  }

  Vec2d image_normal(Vec3d n_obj) const {
    const Vec3d n = T_cam_obj_.R * n_obj;
    const double length = hypotenuse(n.x, n.y);
    return length > 1e-9 ? Vec2d{n.x / length, n.y / length} : Vec2d{1, 0};
  }

  // Whether the object continues inwards and is absent outwards.
  bool is_wide(const ContourPoint& point, double thickness_px) const {
    const Vec3d p = T_cam_obj_ * point.p_obj;
    const Vec2d u = project(K_, p), n = image_normal(point.n_obj);
    const auto hits = [&](double by) { return pass(ray_of({u.x + by * n.x, u.y + by * n.y})).hit; };
    return hits(-thickness_px) && !hits(thickness_px);
  }

  bool is_known(const ContourPoint& point) const {
    return !shape_.seen.amount || shape_.seen.below(shape_.sdf, point.p_obj.cast<float>());
  }

  double voxel_px(double depth_m) const { return voxel_ * K_.fx / depth_m; }

 private:
  const Intrinsics<double> K_;
  const frame::Shape& shape_;
  const SdfView coarse_;
  const Rigidd T_obj_cam_, T_cam_obj_;
  const double voxel_;
};

// The outermost surface points around the projected middle.
void find_rim(const Intrinsics<double>& K, const frame::Shape& shape, const Rigidd& T_cam_obj,
              std::vector<Vec2d>* rim) {
  const Vec2d middle = project(K, T_cam_obj.t);
  const frame::BearingTerm<float> term{T_cam_obj.cast<float>(),
                                       K.cast<float>(),
                                       {float(middle.x), float(middle.y)},
                                       {shape.points.data(), int(shape.points.size()), 1}};
  const frame::PointOps& ops = frame::point_ops_for(used_isa());
  std::array<double, kDirections> radius;
  std::array<std::size_t, kDirections> which{};
  radius.fill(-1);
  frame::Bearings seen;
  for (int first = 0; first < term.points_obj.count(); first += seen.count) {
    ops.bearings(term, first, &seen);
    for (int i = 0; i < seen.count; ++i) {
      const auto k = std::size_t(std::clamp(to_int(seen.turn[i] * kDirections), 0, kDirections - 1));
      if (double(seen.radius_px[i]) > radius[k])
        radius[k] = double(seen.radius_px[i]), which[k] = std::size_t(first + i);
    }
  }
  rim->clear();
  for (std::size_t k = 0; k < kDirections; ++k)
    if (radius[k] >= 0) rim->push_back(project(K, T_cam_obj * shape.points[which[k]].cast<double>()));
}

double turn_of(Vec2d a, Vec2d b, Vec2d c) { return (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x); }

// Andrew's chain; in image axes (y down) the corners go round clockwise.
void find_hull(std::vector<Vec2d>* points, std::vector<Vec2d>* hull) {
  std::sort(points->begin(), points->end(),
            [](Vec2d a, Vec2d b) { return a.x < b.x || (a.x == b.x && a.y < b.y); });
  hull->clear();
  const auto add = [&](Vec2d p, std::size_t least) {
    while (hull->size() >= least + 2 && turn_of((*hull)[hull->size() - 2], hull->back(), p) <= 0)
      hull->pop_back();
    hull->push_back(p);
  };
  for (const Vec2d p : *points) add(p, 0);
  const std::size_t lower = hull->size() - 1;
  for (std::size_t i = points->size() - 1; i-- > 0;) add((*points)[i], lower);
  hull->pop_back();
}

}  // namespace

void find_contour(const Intrinsics<double>& K, const frame::Shape& shape, const Rigidd& T_cam_obj,
                  int requested, double thickness_px, ContourScratch* scratch,
                  std::vector<ContourPoint>* out) {
  out->clear();
  if (requested < 3 || !(T_cam_obj.t.z > shape.diameter_m / 2)) return;  // the eye may be inside its ball
  find_rim(K, shape, T_cam_obj, &scratch->rim);
  if (scratch->rim.size() < 3) return;
  find_hull(&scratch->rim, &scratch->hull);
  const std::vector<Vec2d>& hull = scratch->hull;
  if (hull.size() < 3) return;
  const Contour contour(K, shape, T_cam_obj);
  const double margin_px = kWanted * contour.voxel_px(T_cam_obj.t.z);
  const auto edge = [&](std::size_t i) {
    const Vec2d a = hull[i], b = hull[(i + 1) % hull.size()];
    return Vec2d{b.x - a.x, b.y - a.y};
  };
  double around = 0;
  for (std::size_t i = 0; i < hull.size(); ++i) around += hypotenuse(edge(i).x, edge(i).y);
  const double apart = around / requested;
  double left = 0.5 * apart;  // until the next point
  for (std::size_t i = 0; i < hull.size(); ++i) {
    const Vec2d e = edge(i);
    const double length = hypotenuse(e.x, e.y);
    const Vec2d outwards{e.y / length, -e.x / length};
    for (; left < length; left += apart) {
      const double k = left / length;
      const Vec2d u{hull[i].x + k * e.x + margin_px * outwards.x,
                    hull[i].y + k * e.y + margin_px * outwards.y};
      ContourPoint point;
      if (contour.settle(u, outwards, &point) && contour.is_known(point) &&
          contour.is_wide(point, thickness_px))
        out->push_back(point);
    }
    left -= length;
  }
}

}  // namespace sdftrack::tracking
