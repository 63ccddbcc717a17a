// SPDX-License-Identifier: MIT
#include "tracking/frame_context.h"

#include <algorithm>
#include <cmath>

#include "base/to_int.h"

namespace sdftrack::tracking {

namespace {

constexpr float kExplained_m = 0.006;  // measurements this near to another object's surface belong to it

// `first`: a pixel where a measurement is likely.
bool has_depth(const ImageView<float>& depth_m, int first) {
  const int pixels = depth_m.width * depth_m.height, stride = std::max(1, pixels / 4099);
  if (depth_m.data[first] > 0) return true;
  for (int i = 0; i < pixels; i += stride)
    if (depth_m.data[i] > 0) return true;
  return false;
}

// The pixel of the object's centre, or one at the border.
int pixel_of(const Camera& camera, const Rigidd& T_cam_obj) {
  const Vec2d u = T_cam_obj.t.z > 0 ? camera.project_point(T_cam_obj.t) : Vec2d{0, 0};
  const auto at = [](double v, int n) { return to_int(std::clamp(v, 0.0, n - 1.0)); };
  return at(u.y, camera.height) * camera.width + at(u.x, camera.width);
}

}  // namespace

FrameContext::FrameContext(const Camera& camera, const TrackerOptions& options) : options_(options) {
  set_camera(camera);
}

void FrameContext::set_camera(const Camera& camera) {
  camera_ = camera;
  rays_ = camera.distorted() ? ray_table(camera) : std::vector<float>{};
}

void FrameContext::open(const frame::DepthFrame& frame, const std::vector<TrackedObject>& objects) {
  frame_ = frame, objects_ = &objects;
  fault_ = ReasonCode::kNone;
  together_.assign(objects.size(), std::nullopt);
  readable_ = frame.depth_m.data &&
              has_depth(frame.depth_m, objects.empty() ? 0 : pixel_of(camera_, objects.front().T_cam_obj));
}

void FrameContext::open_next(const frame::DepthFrame& frame, const std::vector<TrackedObject>& objects) {
  open(frame, objects);
  regions_.clear();
  float depth_m = 0;
  for (const TrackedObject& object : objects) {
    if (!object.followed() || !frame.color) continue;
    regions_.push_back(frame::projected_box(camera_, *object.shape, object.T_cam_obj, 0));
    depth_m = float(object.T_cam_obj.t.z);
  }
  fault_ = watch_.look(frame, regions_, depth_m);
}

void FrameContext::follow_plane() {
  regions_.clear();
  for (const TrackedObject& object : *objects_)
    regions_.push_back(frame::projected_box(camera_, *object.shape, object.T_cam_obj, options_.padding_m));
  plane_.update(frame_, camera_, regions_);
}

std::size_t FrameContext::pixels() const { return std::size_t(camera_.width) * camera_.height; }

const appearance::ColorModel* FrameContext::colors_of(const TrackedObject& object) const {
  const bool tell =
      frame_.color && object.colors.known() && object.colors.overlap() <= options_.color_max_overlap;
  return tell ? &object.colors : nullptr;
}

JointFitted* FrameContext::together_of(const TrackedObject& object) {
  std::optional<JointFitted>& joint = together_[number_of(object)];
  return joint ? &*joint : nullptr;
}

const Neighbors& FrameContext::neighbors_of(const TrackedObject& object) {
  neighbors_.clear();
  for (std::size_t k = 0; k < objects_->size(); ++k) {
    const TrackedObject& other = (*objects_)[k];
    if (&other == &object) continue;
    const JointFitted* const now = together_[k] ? &*together_[k] : nullptr;
    const bool sure =
        now ? !now->hidden && convincing(now->fitted, other, options_) : other.holds_its_place();
    if (!sure) continue;
    neighbors_.push_back(field_of(*other.shape, now ? now->fitted.T_cam_obj : other.T_cam_obj));
  }
  return neighbors_;
}

// Marks the measurements on an object's surface.
void FrameContext::claim(const frame::Shape& shape, const Rigidd& T_cam_obj) {
  const Intrinsics<float> K = camera_.K.cast<float>();
  const frame::IdealPixel ideal{frame_, K, camera_.width};
  const frame::Rect box = frame::projected_box(camera_, shape, T_cam_obj, 0);
  const energies::SingleObject<float> field = field_of(shape, T_cam_obj);
  for (int y = box.y0; y < box.y1; ++y)
    for (int x = box.x0; x < box.x1; ++x) {
      const float z = frame_.depth_m(x, y);
      if (!(z > 0)) continue;
      const Vec2f u = ideal(x, y);
      float phi;
      Vec3f unused;
      field.value(z * ray(K, u.x, u.y), &phi, &unused);
      if (std::abs(phi) < kExplained_m) claimed_[std::size_t(y) * camera_.width + x] = 1;
    }
}

const unsigned char* FrameContext::claimed_by_others(const TrackedObject& object) {
  bool any = false;
  for (const TrackedObject& other : *objects_) {
    if (&other == &object || !other.holds_its_place()) continue;
    if (!any) claimed_.assign(pixels(), 0);
    any = true;
    claim(*other.shape, other.T_cam_obj);
  }
  return any ? claimed_.data() : nullptr;
}

// `frame` may be the result of an earlier call.
frame::DepthFrame FrameContext::unclaimed(const frame::DepthFrame& frame, const unsigned char* claimed) {
  if (!claimed) return frame;
  free_.resize(pixels());
  for (std::size_t i = 0; i < free_.size(); ++i) free_[i] = !claimed[i] && (!frame.mask || frame.mask[i]);
  frame::DepthFrame alone = frame;
  alone.mask = free_.data();
  return alone;
}

frame::DepthFrame FrameContext::without_members(const std::vector<int>& members, int k) {
  claimed_.assign(pixels(), 0);
  for (const int m : members) {
    const JointFitted& joint = *together_[m];
    if (m == k || joint.hidden) continue;
    claim(*(*objects_)[m].shape, joint.fitted.T_cam_obj);
  }
  return unclaimed(frame_, claimed_.data());
}

}  // namespace sdftrack::tracking
