// SPDX-License-Identifier: MIT
#include "tracking/trust/silhouette_colors.h"

#include <algorithm>
#include <cmath>

#include "base/pixel_ray.h"
#include "base/to_int.h"
#include "frame/passage.h"
#include "tracking/trust/color_projection.h"

namespace sdftrack::tracking {

namespace {

constexpr double kSilhouetteEdge_px = 3;  // of the silhouette: a pixel there may show both sides
constexpr double kNearer_m = 0.008;       // nearer measurements are those of an occluder
constexpr double kBehind_m = 0.03;        // and farther ones those of what is seen in its place

// Whether the depth along the ray through the surface point p may be the object's; true without depth.
bool may_be_object(const frame::DepthFrame& frame, const Camera& camera, Vec3d p) {
  const double z = frame::reading_at(frame, camera, p);
  return z == 0 || (z > p.z - kNearer_m && z < p.z + kBehind_m);
}

}  // namespace

void count_mask_and_ring_colors(const frame::DepthFrame& frame, const Camera& camera,
                                const std::vector<unsigned char>& mask, double z_m, double around_px,
                                int budget, appearance::ColorCounts* counts) {
  counts->clear();
  frame::Rect box = frame::mask_bounds(mask.data(), camera.width, camera.height);
  if (box.empty()) return;
  const int around = to_int(around_px);
  box = {std::max(0, box.x0 - around), std::max(0, box.y0 - around), std::min(camera.width, box.x1 + around),
         std::min(camera.height, box.y1 + around)};
  const energies::ColorProjection view = color_projection(camera, frame.color->map);
  const double area = double(box.x1 - box.x0) * (box.y1 - box.y0);
  const int step = std::max(1, to_int(std::ceil(std::sqrt(area / budget))));
  const LensRays rays(camera);
  for (int y = box.y0; y < box.y1; y += step)
    for (int x = box.x0; x < box.x1; x += step) {
      const auto i = std::size_t(y) * camera.width + x;
      const auto read_m = double(frame.depth_m(x, y));
      Vec2d c;
      if (!view.place((read_m > 0 ? read_m : z_m) * rays.at(x, y), &c)) continue;
      if (!(c.x > -0.5 && c.y > -0.5 && c.x < view.width - 0.5 && c.y < view.height - 0.5)) continue;
      const int bin = appearance::color_bin(frame.color->at(to_int(c.x + 0.5), to_int(c.y + 0.5)));
      if (mask[i])
        counts->add_object(bin, 1);
      else
        counts->add_background(bin);
    }
}

void count_silhouette_colors(const frame::DepthFrame& frame, const Camera& camera, const frame::Shape& shape,
                             const Rigidd& T_cam_obj, double around_px, int budget,
                             const appearance::ColorModel& known, appearance::ColorCounts* counts) {
  counts->clear();
  if (!(T_cam_obj.t.z > 0)) return;
  const Camera ideal{camera.K, camera.width, camera.height, {}};
  const double m_per_px = T_cam_obj.t.z / camera.K.fx;
  const frame::Rect box = frame::projected_box(ideal, shape, T_cam_obj, around_px * m_per_px);
  if (box.empty()) return;
  const energies::ColorProjection view = color_projection(camera, frame.color->map);
  const double area = double(box.x1 - box.x0) * (box.y1 - box.y0);
  const int step = std::max(1, to_int(std::ceil(std::sqrt(area / budget))));
  const Rigidd T_obj_cam = inverse(T_cam_obj);
  const SdfView coarse = shape.coarse();
  for (int y = box.y0; y < box.y1; y += step)
    for (int x = box.x0; x < box.x1; x += step) {
      const Vec2d u{double(x), double(y)};
      const frame::Passage passage = frame::pass(shape, coarse, frame::object_ray(camera.K, T_obj_cam, u));
      if (!passage.hit && passage.phi < kSilhouetteEdge_px * m_per_px) continue;
      const Vec3d nearest = std::max(1e-3, passage.t) * ray(camera.K, u.x, u.y);
      Vec2d c;
      if (!view.place(nearest, &c)) continue;
      if (!(c.x > -0.5 && c.y > -0.5 && c.x < view.width - 0.5 && c.y < view.height - 0.5)) continue;
      const int bin = appearance::color_bin(frame.color->at(to_int(c.x + 0.5), to_int(c.y + 0.5)));
      if (passage.hit) {
        if (may_be_object(frame, camera, nearest)) counts->add_object(bin, known.weight(bin));
      } else {
        counts->add_background(bin);
      }
    }
}

}  // namespace sdftrack::tracking
