// SPDX-License-Identifier: MIT
// Fits objects that may touch or hide each other together, and singly where that is not convincing.
#pragma once

#include <optional>
#include <vector>

#include "tracking/object_follower.h"

namespace sdftrack::tracking {

class GroupFitter {
 public:
  // The follower makes the single fits and must outlive this object.
  GroupFitter(const TrackerOptions& options, const TrackerSettings& settings, ObjectFollower* follower)
      : options_(options),
        follower_(follower),
        joint_(options, settings.collision, settings.threads, follower->device()) {}

  // Fits the objects that may touch: FrameContext::together. Objects that stand alone are not fitted here.
  void fit(FrameContext* context, const std::vector<TrackedObject>& objects);
  // Accepts an object that was fitted together with others: the object takes over the fitted state.
  ObjectResult accept(JointFitted* joint, const FrameContext& context, TrackedObject* object) const;

 private:
  using Objects = std::vector<TrackedObject>;

  void find_groups(const Objects& objects, double time_s);
  void fit_group(FrameContext* context, const Objects& objects, std::vector<int>* group);
  void refuse_doubles(FrameContext* context, const Objects& objects, std::vector<int>* members);
  void fit_together(FrameContext* context, const Objects& objects, const std::vector<int>& members);
  bool mend(FrameContext* context, const Objects& objects, const std::vector<int>& members);
  void weigh_play(FrameContext* context, const Objects& objects, const std::vector<int>& members);
  std::optional<Rigidd> carried_pose(const FrameContext& context, const Objects& objects,
                                     const std::vector<int>& members, std::size_t i) const;
  void give_up_doubles(FrameContext* context, const Objects& objects, const std::vector<int>& members) const;

  TrackerOptions options_;
  ObjectFollower* follower_;
  JointFitter joint_;
  // Of the current frame
  std::vector<std::vector<int>> groups_;
  std::size_t group_count_ = 0;
  std::vector<unsigned char> visited_;
  std::vector<Rigidd> expected_;
  std::vector<FitTarget> targets_;
  Neighbors places_;
};

}  // namespace sdftrack::tracking
