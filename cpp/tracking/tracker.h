// SPDX-License-Identifier: MIT
// The per-frame procedure: fit from the expected pose, more widely if not convincing, judge, search.
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

// Tracks shapes, each from its last pose: jointly those that may touch, the others singly.
class Tracker {
 public:
  // The volumes behind the shapes' views belong to the caller and outlive the tracker.
  Tracker(const std::vector<SdfView>& shapes, const Camera& camera, const TrackerOptions& options,
          const TrackerSettings& settings);
  Tracker(const Tracker&) = delete;  // its parts know each other by address
  Tracker& operator=(const Tracker&) = delete;

  int object_count() const { return int(objects_.size()); }
  const Camera& camera() const { return context_.camera(); }
  const TrackerOptions& options() const { return options_; }
  int threads() const { return settings_.threads; }
  bool is_primitive(int k) const { return object(k).primitive; }
  // Whether the shape is stated to have the object's size.
  bool has_known_size(int k) const { return !object(k).free_scale && !object(k).primitive; }
  void set_camera(const Camera& camera) { context_.set_camera(camera); }  // of the next frames
  // color: nullptr, or the frame's colours: used once an accepted pose has shown the object's colours.
  frame::DepthFrame make_frame(const ImageView<float>& depth_m, const unsigned char* mask, double time_s,
                               const appearance::ColorImage* color) const;
  // A frame without a depth image; `error`: the reason, kept by the caller. Empty: there never was one.
  frame::DepthFrame make_unreadable_frame(std::string_view error, double time_s,
                                          const appearance::ColorImage* color = nullptr) const;

  // What start, track and recover return is valid until the next call.
  // Forgets all history and starts at the given places.
  const FrameResult& start(const frame::DepthFrame& frame, const std::vector<PoseHint>& hints);
  const FrameResult& track(const frame::DepthFrame& frame);
  // Searches for objects[i] at hints[i] now; the other objects and the frame's number are unchanged.
  const FrameResult& recover(const frame::DepthFrame& frame, const std::vector<int>& objects,
                             const std::vector<PoseHint>& hints);
  // Follows the objects into a frame outside the sequence; the record of the sequence is unchanged. Returns
  // one result for each object.
  const std::vector<ObjectResult>& revisit(const frame::DepthFrame& frame);
  // A tracker of object k alone, of the same shape and options, to try starts; nothing is declared.
  std::unique_ptr<Tracker> alone(int k, bool recover = true) const;
  // Appends to the reason in the last result.
  void add_to_reason(int k, const std::string& more);
  // The only object was found among the objects that stand in the image; its place was not stated.
  void doubt_standing();
  const FrameResult& last_result() const { return verdict_.result(); }
  const Poses& last_good_poses() const { return verdict_.last_good(); }
  // T_cam_obj of the other poses of object k that explained the frames since its start as well.
  std::vector<Rigidd> alternative_poses(int k) const;

  // Evaluates object k at a pose, without fitting or remembering. No result: too few measurements are near.
  std::optional<Fitted> look(const frame::DepthFrame& frame, int k, const Rigidd& T_cam_obj);
  // H * W * M soft weights of the last poses in this frame, and H * W probabilities by colour that a pixel
  // shows an object (NaN: not known).
  void find_membership(const frame::DepthFrame& frame, float* membership, float* foreground);
  // The same for the pixels of a box, row by row: the probability by colour; NaN where not known.
  void find_foreground(const frame::DepthFrame& frame, int k, const frame::Rect& box,
                       std::vector<float>* foreground);

  // Replaces the last pose; `information` of the increment of T_obj_cam (centred) makes it a prior.
  void set_pose(int k, const Rigidd& T_cam_obj, const std::optional<Matrix6d>& covariance_cam);
  // The object is searched for at `hint` in the next frame. Returns its number.
  int add(const SdfView& shape, const PoseHint& hint);
  void remove(int k);

  // Replaces the volumes of the same objects, which continue from these poses; the sequence's record is kept.
  void replace_shapes(const std::vector<SdfView>& shapes, const Poses& poses);
  // Object k has another shape from now on, in the same object frame; its centre is kept.
  void reshape(int k, frame::PartialShape known);
  // The object frame of object k is moved: its pose T_cam_obj becomes T_cam_obj * motion. Its motion goes on.
  void move_frame(int k, const Rigidd& motion);
  void free_scale(int k) { object(k).free_scale = true; }
  bool has_free_scale(int k) const { return object(k).free_scale; }
  // Enlarges object k to the scale that the measurements show. Returns the log scale that was added; 0: it is
  // too small or too uncertain.
  double adjust_scale(int k);
  // Enlarges object k by exp(log_scale) about the origin of its frame.
  void enlarge(int k, double log_scale);
  // Log scale relative to the first given volume, and its sd; infinite: not known. It cannot be told from a
  // distance error of the sensor.
  SizeTest::LogScale scale(int k) const;
  // Sets the colours of the surface of object k.
  void paint(int k, const energies::ColorView& colors);
  // How much later the colour images are than the depth images, from all objects since the start.
  ColorDelay::Estimate color_delay() const;
  const frame::Shape& shape(int k) const { return *object(k).shape; }
  // Poses of object k that differ by one of these motions are equivalent: results have the one nearest to the
  // last result, at a start to the given pose, else to the camera's axes.
  void set_symmetry(int k, const frame::Symmetry& symmetry);
  // Object k is a placeholder for a primitive of this kind, not found yet; empty: it is found.
  void mark_unfound(int k, const std::string& kind) { object(k).unfound = kind, object(k).primitive = true; }

  // Resumes a sequence whose record was kept elsewhere (Verdict::resume); tracking continues from its poses.
  void resume(int index, double time_s, const std::vector<bool>& followed, const Poses& best);
  // The next frame does not follow the last one: no motion links them. index: of the last frame from now on.
  void interrupt(int index);

  // For state_of and set_state: all that the next frames depend on, except shapes, camera and settings.
  template <class Archive, class Self>
  static void visit(Archive& archive, Self& self) {
    auto& [options, settings, objects, context, follower, groups, recovery, membership, verdict, served,
           order, answers] = self;
    archive.in_place(objects);
    archive(context, verdict);
    archive.check(verdict.last_good().size() == objects.size());
    for (auto& object : objects)
      archive.check(!object.requested || object.requested->mask.empty() ||
                    object.requested->mask.size() == context.pixels());
  }

 private:
  using Object = TrackedObject;

  Tracker(const TrackedObject& object, const Camera& camera, const TrackerOptions& options,
          const TrackerSettings& settings);
  TrackedObject& object(int k) { return objects_.at(std::size_t(k)); }
  const TrackedObject& object(int k) const { return objects_.at(std::size_t(k)); }
  Object new_object(std::shared_ptr<const frame::Shape> shape) const;
  std::shared_ptr<const frame::Shape> shape_of(const SdfView& sdf) const;
  void place(const Rigidd& T_cam_obj, Object* object) const;
  void go_on_from(const Poses& poses);

  const FrameResult& finish_frame(const frame::DepthFrame& frame);
  void process_all();
  template <class Work>
  void process_each(const Work& work);
  ObjectResult track_one(Object* object);
  ObjectResult begin_at(Object* object, const PoseHint& hint);
  ObjectResult begin_at_pose(Object* object, const Rigidd& T_cam_obj);  // centred
  ObjectResult doubt_mask(const Object& object, ObjectResult result) const;
  ObjectResult follow(Object* object);
  ObjectResult unread(Object* object) const;
  void explain_loss(const TrackedObject& object, ObjectResult* result) const;
  void refuse_if_not_finite(const Rigidd& before, Object* object, ObjectResult* result) const;

  TrackerOptions options_;
  TrackerSettings settings_;
  std::vector<Object> objects_;
  FrameContext context_;
  ObjectFollower follower_;
  GroupFitter groups_;
  Recovery recovery_;
  Membership membership_;
  Verdict verdict_;
  // Of the current call: the objects that it serves, their order, and the result of each.
  std::vector<int> requested_;
  std::vector<std::size_t> order_;
  std::vector<ObjectResult> results_;
};

}  // namespace sdftrack::tracking
