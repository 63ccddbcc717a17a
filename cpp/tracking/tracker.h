// SPDX-License-Identifier: MIT
// The per-frame recipe: fit from the expected pose, wider where that does not convince, judge, and search for
// what is lost.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "energies/cuda_work.h"
#include "tracking/finder.h"
#include "tracking/joint_fit.h"
#include "tracking/plane.h"
#include "tracking/tracked_object.h"

namespace sdftrack {

struct ObjectResult {
  Rigidd T_cam_obj;     // of the caller's object frame; the last good one when lost
  Matrix6d covariance;  // NaN when lost
  Trust trust;
  double cost = 0;       // mean per pixel of the last stage
  double runner_up = 0;  // after a search: score of the best other pose over this one's; NaN: no search
  std::vector<TrackStep> steps;
  bool color_used = false;
  double foreground = -1;  // mean posterior of the colours on the surface; -1: no colours
};

struct TrackerSettings {
  int threads = 1;
  bool recover = true;  // search for lost objects in every frame
  bool cuda = false;    // large sums on the GPU
  Collision collision = Collision::kContact;
  MotionModel motion = MotionModel::kStatic;
};

// Tracks shapes, each from its own last pose: those that may touch together, the others one by one.
class Tracker {
 public:
  // The volumes behind the shapes' views belong to the caller and outlive the tracker.
  Tracker(const std::vector<SdfView>& shapes, const Camera& camera, const TrackerOptions& options,
          const TrackerSettings& settings);

  int object_count() const { return static_cast<int>(objects_.size()); }
  const Camera& camera() const { return camera_; }
  const TrackerOptions& options() const { return options_; }
  void set_camera(const Camera& camera);  // of the frames to come
  // color: nullptr, or the frame's: used as soon as an accepted pose has shown the object's colours.
  DepthFrame make_frame(const ImageView<float>& depth_m, const unsigned char* mask, double time_s,
                        const ColorImage* color) const;

  // What start, track and recover return is valid until the next of them.
  // Forgets all history and begins at the given places.
  const std::vector<ObjectResult>& start(const DepthFrame& frame, const std::vector<Whereabouts>& places);
  const std::vector<ObjectResult>& track(const DepthFrame& frame);
  // Searches for objects[i] at places[i] now; the others are left alone. One result for each.
  const std::vector<ObjectResult>& recover(const DepthFrame& frame, const std::vector<int>& objects,
                                           const std::vector<Whereabouts>& places);
  // Object k at a pose as it is: nothing is fitted or remembered. None where too few readings are near.
  std::optional<Fitted> look(const DepthFrame& frame, int k, const Rigidd& T_cam_obj);
  // Replaces the last pose; `information` of the increment of T_obj_cam (centred) makes it a prior.
  void set_pose(int k, const Rigidd& T_cam_obj, const std::optional<Matrix6d>& covariance_cam);
  // Object k has another shape from now on, in the object frame as it was; its centre is kept.
  void reshape(int k, PartialShape known);
  // The surface of object k has these colours.
  void paint(int k, const ColorView& colors);
  // The chance by colour that a pixel of the box is object k's: of the box alone, row by row, NaN where not
  // known.
  void find_foreground(const DepthFrame& frame, int k, const Rect& box, std::vector<float>* foreground);
  const Shape& shape(int k) const { return *objects_.at(static_cast<std::size_t>(k)).shape; }
  // Looked for at `place` in the next frame. Returns its number.
  int add(const SdfView& shape, const Whereabouts& place);
  void remove(int k);
  // Pairs (k, j) among `of` where the middle of j lies deep in k.
  std::vector<std::pair<int, int>> overlaps(const std::vector<int>& of) const;
  // H * W * M soft weights of the last poses in this frame, and H * W the chance by colour that a pixel is an
  // object's (NaN: not known).
  void find_membership(const DepthFrame& frame, float* membership, float* foreground);

 private:
  using Object = TrackedObject;

  Object new_object(const SdfView& sdf) const;
  std::shared_ptr<const Shape> shape_of(const SdfView& sdf) const;
  template <class Work>
  const std::vector<ObjectResult>& each(const DepthFrame& frame, const std::vector<int>& objects,
                                        const Work& work);
  bool readable(const DepthFrame& frame) const;
  void follow_plane(const DepthFrame& frame);
  static ObjectResult unread(Object* object);
  void mark_explained(const DepthFrame& frame, const Shape& shape, const Rigidd& T_cam_obj);
  DepthFrame not_taken(const DepthFrame& frame, const unsigned char* taken);
  const Others* others_than(const Object& object);
  const unsigned char* taken_by_others(const DepthFrame& frame, const Object& object);
  const ColorModel* colors_of(const DepthFrame& frame, const Object& object) const;
  void learn_colors(const DepthFrame& frame, Object* object);

  void read_foreground(const DepthFrame& frame, int k, const Rect& box, float* foreground);

  ObjectResult begin_at(const DepthFrame& frame, Object* object, const Whereabouts& place);
  ObjectResult track_one(const DepthFrame& frame, Object* object);
  ObjectResult follow(const DepthFrame& frame, Object* object);
  ObjectResult followed_together(const DepthFrame& frame, JointFitted* joint, Object* object);
  ObjectResult confirmed(ObjectResult result, Object* object);
  ObjectResult look_for(const DepthFrame& frame, Object* object, ObjectResult lost);

  std::optional<Fitted> best_fit(const DepthFrame& frame, const Object& object, const Rigidd& expected);
  std::optional<Fitted> further_fits(const DepthFrame& frame, const Object& object, const Rigidd& expected,
                                     std::optional<Fitted> best);
  FitTarget target_of(const DepthFrame& frame, const Object& object, const Rigidd& expected) const;

  // Which of the look-alikes it is (identity.cpp)
  void tell_finds_apart(const std::vector<int>& objects);
  void exchange_finds(const std::vector<int>& objects, std::size_t i, std::size_t j);
  void hand_over_find(const std::vector<int>& objects, std::size_t from, std::size_t to);
  void doubt_identity(std::size_t k, ObjectResult* result);

  // Groups of objects that may touch (groups.cpp)
  void tell_apart(const std::vector<int>& members);
  void fit_groups(const DepthFrame& frame);
  void find_groups(double time_s);
  void fit_group(const DepthFrame& frame, std::vector<int>* group);
  void refuse_doubles(std::vector<int>* members);
  bool mend_group(const DepthFrame& frame, const std::vector<int>& members);
  void fit_together(const DepthFrame& frame, const std::vector<int>& members);
  DepthFrame without_others(const DepthFrame& frame, const std::vector<int>& members, int k);
  std::optional<Fitted> fit(const DepthFrame& frame, const Object& object, const Attempt& attempt,
                            const Rigidd& expected);
  Fitted polished(const DepthFrame& frame, const Object& object, const Fitted& wide);
  Rigidd expected_pose(const Object& object, double time_s) const;
  Attempt narrow_attempt(const Rigidd& T_cam_obj) const;
  Attempt wide_attempt(const Object& object, const Rigidd& expected, double time_s) const;

  ObjectResult judged(Fitted fitted, const Trust& trust, double time_s, Object* object) const;
  void keep(const Fitted& fitted, const Trust& trust, double time_s, Object* object) const;
  static ObjectResult without_pose(const Object& object, std::string reason, Status status);

  std::vector<Object> objects_;
  Camera camera_;
  TrackerOptions options_;
  TrackerSettings settings_;
  std::vector<float> rays_;  // empty without distortion
  PlaneFollower plane_;
  std::unique_ptr<CudaWork> device_;  // nullptr without
  PoseFitter fitter_;
  JointFitter joint_;
  ObjectFinder finder_;
  std::vector<unsigned char> taken_, free_;
  Others others_;
  const Others* beside_ = nullptr;  // of the object in hand; nullptr: it is fitted alone
  // Of the frame in hand: the groups, and what has been fitted together, by object.
  std::vector<std::vector<int>> groups_;
  std::size_t group_count_ = 0;
  std::vector<unsigned char> visited_;
  std::vector<Rigidd> expected_;
  std::vector<std::optional<JointFitted>> together_;
  std::vector<FitTarget> targets_;
  std::vector<int> everyone_;       // 0, 1, ...
  std::vector<std::size_t> order_;  // in which the objects of a call are served
  std::vector<ObjectResult> results_;
  ColorReader color_reader_;
  ColorCounts color_counts_;
  std::vector<float> foreground_;
};

}  // namespace sdftrack
