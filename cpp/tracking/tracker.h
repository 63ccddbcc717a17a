// SPDX-License-Identifier: MIT
// The per-frame recipe: fit from the expected pose, wider where that does not convince, judge, and search for
// what is lost.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "base/state_archive.h"
#include "tracking/group_fitter.h"
#include "tracking/membership.h"
#include "tracking/recovery.h"
#include "tracking/verdict.h"

namespace sdftrack::tracking {

// Tracks shapes, each from its own last pose: those that may touch together, the others one by one.
class Tracker {
 public:
  // The volumes behind the shapes' views belong to the caller and outlive the tracker.
  Tracker(const std::vector<SdfView>& shapes, const Camera& camera, const TrackerOptions& options,
          const TrackerSettings& settings);
  Tracker(const Tracker&) = delete;  // its parts know each other by address
  Tracker& operator=(const Tracker&) = delete;

  int object_count() const { return static_cast<int>(objects_.size()); }
  const Camera& camera() const { return context_.camera(); }
  const TrackerOptions& options() const { return options_; }
  void set_camera(const Camera& camera) { context_.set_camera(camera); }  // of the frames to come
  // color: nullptr, or the frame's: used as soon as an accepted pose has shown the object's colours.
  frame::DepthFrame make_frame(const ImageView<float>& depth_m, const unsigned char* mask, double time_s,
                               const appearance::ColorImage* color) const;
  // One without a depth image; `error`: why, kept by the caller. Empty: it never had one.
  frame::DepthFrame make_unreadable_frame(std::string_view error, double time_s,
                                          const appearance::ColorImage* color = nullptr) const;

  // What start, track and recover return is valid until the next call.
  // Forgets all history and begins at the given places.
  const FrameResult& start(const frame::DepthFrame& frame, const std::vector<PoseHint>& hints);
  const FrameResult& track(const frame::DepthFrame& frame);
  // Searches for objects[i] at hints[i] now; the others, and the frame's number, stay as they are.
  const FrameResult& recover(const frame::DepthFrame& frame, const std::vector<int>& objects,
                             const std::vector<PoseHint>& hints);
  // Follows the objects into a frame outside of the sequence, whose record stays as it is: one answer for
  // each.
  const std::vector<ObjectResult>& revisit(const frame::DepthFrame& frame);
  const FrameResult& last_result() const { return verdict_.result(); }
  const Poses& last_good_poses() const { return verdict_.last_good(); }

  // Object k at a pose as it is: nothing is fitted or remembered. None where too few readings are near.
  std::optional<Fitted> look(const frame::DepthFrame& frame, int k, const Rigidd& T_cam_obj);
  // H * W * M soft weights of the last poses in this frame, and H * W the chance by colour that a pixel is an
  // object's (NaN: not known).
  void find_membership(const frame::DepthFrame& frame, float* membership, float* foreground);
  // The chance by colour that a pixel of the box is object k's: of the box alone, row by row, NaN where not
  // known.
  void find_foreground(const frame::DepthFrame& frame, int k, const frame::Rect& box,
                       std::vector<float>* foreground);

  // Replaces the last pose; `information` of the increment of T_obj_cam (centred) makes it a prior.
  void set_pose(int k, const Rigidd& T_cam_obj, const std::optional<Matrix6d>& covariance_cam);
  // Looked for at `hint` in the next frame. Returns its number.
  int add(const SdfView& shape, const PoseHint& hint);
  void remove(int k);

  // Other volumes for the same objects, which go on from these poses; the sequence's record stays.
  void replace_shapes(const std::vector<SdfView>& shapes, const Poses& poses);
  // Object k has another shape from now on, in the object frame as it was; its centre is kept.
  void reshape(int k, frame::PartialShape known);
  // The scale of object k is not known: from now on it is estimated.
  void free_scale(int k) { object(k).free_scale = true; }
  // By which log scale its volume is to be enlarged now (rescale); 0: as well as is known, none.
  double log_scale_to_add(int k) const;
  // `scaled` is its volume enlarged by exp(log_scale) about the origin of its frame.
  void rescale(int k, const SdfView& scaled, double log_scale);
  // Log scale over the volume that was given first and its sd; infinite: not known. What the sensor may be
  // off by in distance cannot be told from it.
  SizeTest::LogScale scale(int k) const;
  // The surface of object k has these colours.
  void paint(int k, const energies::ColorView& colors);
  // By how much colour is later than depth, by all objects since the start.
  ColorDelay::Estimate color_delay() const;
  const frame::Shape& shape(int k) const { return *object(k).shape; }
  // Motions in object k's frame that leave it as it is; poses that differ by one of them are one answer.
  void set_symmetries(int k, const std::vector<Rigidd>& motions);
  // Object k is a placeholder for a primitive of this kind, not found yet; empty: it is found.
  void mark_unfound(int k, const std::string& kind) { object(k).unfound = kind, object(k).primitive = true; }

  // The record of a sequence that was kept elsewhere (Verdict::resume); every pose in it is gone on from.
  void resume(int index, double time_s, const std::vector<bool>& followed, const Poses& best);
  // The next frame does not follow the last one: no motion leads to it. index: of the last one from now on.
  void interrupt(int index);

  // For state_of and set_state: all that the next frames depend on, but for shapes, camera and settings.
  template <class Archive, class Self>
  static void visit(Archive& archive, Self& self) {
    auto& [options, settings, objects, context, follower, groups, recovery, membership, verdict, served,
           order, answers] = self;
    archive.in_place(objects);
    archive(context, verdict);
    archive.check(verdict.last_good().size() == objects.size());
    for (auto& object : objects)
      archive.check(!object.wanted || object.wanted->mask.empty() ||
                    object.wanted->mask.size() == context.pixels());
  }

 private:
  using Object = TrackedObject;

  TrackedObject& object(int k) { return objects_.at(static_cast<std::size_t>(k)); }
  const TrackedObject& object(int k) const { return objects_.at(static_cast<std::size_t>(k)); }
  Object new_object(const SdfView& sdf) const;
  std::shared_ptr<const frame::Shape> shape_of(const SdfView& sdf) const;
  void place(const Rigidd& T_cam_obj, Object* object) const;
  void go_on_from(const Poses& poses);

  const FrameResult& concluded(const frame::DepthFrame& frame);
  void answer_all();
  template <class Work>
  void answer_each(const Work& work);
  ObjectResult track_one(Object* object);
  ObjectResult begin_at(Object* object, const PoseHint& hint);
  ObjectResult begin_at_pose(Object* object, const Rigidd& T_cam_obj);  // centred
  ObjectResult doubt_mask(const Object& object, ObjectResult result) const;
  ObjectResult follow(Object* object);
  ObjectResult unread(Object* object) const;
  void explain_loss(const TrackedObject& object, ObjectResult* answer) const;
  void refuse_if_not_finite(const Rigidd& before, Object* object, ObjectResult* answer) const;

  TrackerOptions options_;
  TrackerSettings settings_;
  std::vector<Object> objects_;
  FrameContext context_;
  ObjectFollower follower_;
  GroupFitter groups_;
  Recovery recovery_;
  Membership membership_;
  Verdict verdict_;
  // Of the call in hand: which objects it serves, in which order, and what is said of each.
  std::vector<int> served_;
  std::vector<std::size_t> order_;
  std::vector<ObjectResult> answers_;
};

}  // namespace sdftrack::tracking
