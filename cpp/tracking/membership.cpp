// SPDX-License-Identifier: MIT
#include "tracking/membership.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace sdftrack::tracking {

namespace {

constexpr double kNear_m = 0.01;  // a measurement farther than this from all surfaces belongs to no object

frame::Rect united(const frame::Rect& a, const frame::Rect& b) {
  if (a.empty()) return b;
  if (b.empty()) return a;
  return {std::min(a.x0, b.x0), std::min(a.y0, b.y0), std::max(a.x1, b.x1), std::max(a.y1, b.y1)};
}

// Shares of the objects in a pixel, from their distances: exp(-a phi) over the sum of all; NaN phi: too far.
void share_out(const std::vector<float>& phi_m, float sharpness_per_m, float* share) {
  float least = float(kNear_m), sum = 0;
  bool any = false;
  for (const float phi : phi_m)
    if (std::abs(phi) < float(kNear_m)) least = any ? std::min(least, phi) : phi, any = true;
  for (std::size_t k = 0; k < phi_m.size(); ++k) {
    const bool near = std::abs(phi_m[k]) < float(kNear_m);
    share[k] = near ? std::exp(sharpness_per_m * (least - phi_m[k])) : 0;
    sum += share[k];
  }
  for (std::size_t k = 0; k < phi_m.size() && sum > 0; ++k) share[k] /= sum;
}

}  // namespace

void Membership::find(const FrameContext& context, const std::vector<TrackedObject>& objects,
                      float* membership, float* foreground) {
  const std::size_t count = objects.size();
  const Camera& camera = context.camera();
  std::fill_n(membership, context.pixels() * count, 0.0f);
  std::fill_n(foreground, context.pixels(), std::numeric_limits<float>::quiet_NaN());
  if (!context.frame().depth_m.data) return;  // an unreadable frame
  std::vector<energies::SingleObject<float>> fields;
  std::vector<frame::Rect> boxes;
  frame::Rect all{0, 0, 0, 0};
  float voxel_m = std::numeric_limits<float>::max();
  for (const TrackedObject& object : objects) {
    fields.push_back(field_of(*object.shape, object.T_cam_obj));
    boxes.push_back(object.followed() ? frame::projected_box(camera, *object.shape, object.T_cam_obj, kNear_m)
                                      : frame::Rect{0, 0, 0, 0});
    all = united(all, boxes.back());
    voxel_m = std::min(voxel_m, object.shape->sdf.voxel_m);
  }
  const float sharpness_per_m = float(options_.coarse_union_sharpness) / voxel_m;
  const Intrinsics<float> K = camera.K.cast<float>();
  const frame::IdealPixel ideal{context.frame(), K, camera.width};
  std::vector<float> phi_m(count);
  for (int y = all.y0; y < all.y1; ++y)
    for (int x = all.x0; x < all.x1; ++x) {
      const float z = context.frame().depth_m(x, y);
      if (!(z > 0)) continue;
      const Vec2f u = ideal(x, y);
      for (std::size_t k = 0; k < count; ++k) {
        const frame::Rect& box = boxes[k];
        phi_m[k] = std::numeric_limits<float>::quiet_NaN();
        if (x < box.x0 || x >= box.x1 || y < box.y0 || y >= box.y1) continue;
        Vec3f unused;
        fields[k].value(z * ray(K, u.x, u.y), &phi_m[k], &unused);
      }
      const auto at = std::size_t(y) * camera.width + x;
      share_out(phi_m, sharpness_per_m, membership + at * count);
    }
  for (std::size_t k = 0; k < count; ++k) add_foreground(context, objects[k], boxes[k], foreground);
}

// The larger value where several objects are requested.
void Membership::add_foreground(const FrameContext& context, const TrackedObject& object,
                                const frame::Rect& box, float* foreground) {
  find_foreground(context, object, box, &foreground_);
  const float* own = foreground_.data();
  for (int y = box.y0; y < box.y1; ++y)
    for (int x = box.x0; x < box.x1; ++x, ++own) {
      float& to = foreground[y * context.camera().width + x];
      if (!std::isnan(*own)) to = std::isnan(to) ? *own : std::max(to, *own);
    }
}

void Membership::find_foreground(const FrameContext& context, const TrackedObject& object,
                                 const frame::Rect& box, std::vector<float>* foreground) {
  const frame::DepthFrame& frame = context.frame();
  const Camera& camera = context.camera();
  const auto width = std::size_t(std::max(0, box.x1 - box.x0));
  foreground->assign(width * std::size_t(std::max(0, box.y1 - box.y0)),
                     std::numeric_limits<float>::quiet_NaN());
  const appearance::ColorModel* const colors = context.colors_of(object);
  if (!colors || !frame.depth_m.data || foreground->empty()) return;
  color_reader_.open(frame, camera, box,
                     frame::depth_range(*object.shape, object.T_cam_obj, options_.padding_m));
  const frame::IdealPixel ideal{frame, camera.K.cast<float>(), camera.width};
  float* to = foreground->data();
  for (int y = box.y0; y < box.y1; ++y)
    for (int x = box.x0; x < box.x1; ++x, ++to) {
      const float z = frame.depth_m(x, y);
      if (!(z > 0)) continue;
      const int bin = color_reader_.bin(y * camera.width + x, ideal(x, y), z);
      if (bin >= 0) *to = colors->posterior()[bin];
    }
}

}  // namespace sdftrack::tracking
