// SPDX-License-Identifier: MIT
// What the parts of a tracker share about the current frame.
#pragma once

#include <optional>
#include <vector>

#include "plane/plane.h"
#include "tracking/frame_watch.h"
#include "tracking/several/joint_fit.h"
#include "tracking/tracked_object.h"

namespace sdftrack::tracking {

// Opened once per frame and passed on: the frame, its camera, the table, and how objects near one another
// affect a fit. Memory is kept from frame to frame.
class FrameContext {
 public:
  FrameContext(const Camera& camera, const TrackerOptions& options);

  void set_camera(const Camera& camera);  // of the next frames
  const float* rays() const { return rays_.empty() ? nullptr : rays_.data(); }

  // The objects are kept by address: the queries below see their current state.
  void open(const frame::DepthFrame& frame, const std::vector<TrackedObject>& objects);
  // Opens the next frame of the sequence and compares it with the last one. Other frames have no fault.
  void open_next(const frame::DepthFrame& frame, const std::vector<TrackedObject>& objects);
  void forget_sequence() { watch_.forget(), fault_ = ReasonCode::kNone; }
  ReasonCode fault() const { return fault_; }  // of the sequence's last frame; kNone for other frames
  // Searches for the table outside the objects.
  void follow_plane();
  void forget_plane() { plane_ = {}; }

  const frame::DepthFrame& frame() const { return frame_; }
  const Camera& camera() const { return camera_; }
  const frame::Plane* plane() const { return plane_.plane(); }
  bool readable() const { return readable_; }
  bool has_several() const { return objects_->size() > 1; }
  std::size_t pixels() const;

  // nullptr: depth alone is used.
  const appearance::ColorModel* colors_of(const TrackedObject& object) const;
  // The fields of the other reliably followed objects, at their poses in this frame where these are known.
  // Valid until the next call.
  const Neighbors& neighbors_of(const TrackedObject& object);
  // Pixels that the other followed objects explain; nullptr: none. Valid until the next call.
  const unsigned char* claimed_by_others(const TrackedObject& object);
  // A copy of the frame without the measurements that other objects claim, which would attract a fit.
  frame::DepthFrame unclaimed(const frame::DepthFrame& frame, const unsigned char* claimed);
  // The frame without the measurements on the other members' surfaces, at their jointly fitted poses.
  frame::DepthFrame without_members(const std::vector<int>& members, int k);

  std::optional<JointFitted>& together(std::size_t k) { return together_[k]; }
  const std::optional<JointFitted>& together(std::size_t k) const { return together_[k]; }
  // The joint fit of this object; nullptr: it is fitted alone.
  JointFitted* together_of(const TrackedObject& object);

  template <class Archive, class Self>
  static void visit(Archive& archive, Self& self) {
    auto& [options, camera, rays, plane, watch, fault, frame, objects, readable, together, claimed, free,
           neighbors, regions] = self;
    archive(plane, watch);
  }

 private:
  std::size_t number_of(const TrackedObject& object) const { return std::size_t(&object - objects_->data()); }
  void claim(const frame::Shape& shape, const Rigidd& T_cam_obj);

  TrackerOptions options_;
  Camera camera_;
  std::vector<float> rays_;  // empty without distortion
  plane::PlaneFollower plane_;

  FrameWatch watch_;
  ReasonCode fault_ = ReasonCode::kNone;

  frame::DepthFrame frame_{};
  const std::vector<TrackedObject>* objects_ = nullptr;
  bool readable_ = false;
  std::vector<std::optional<JointFitted>> together_;
  std::vector<unsigned char> claimed_, free_;
  Neighbors neighbors_;
  std::vector<frame::Rect> regions_;
};

}  // namespace sdftrack::tracking
