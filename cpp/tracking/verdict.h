// SPDX-License-Identifier: MIT
// What is finally said of a frame: the answers of the parts, made consistent with one another and with the
// frames before.
#pragma once

#include <optional>
#include <vector>

#include "tracking/result.h"

namespace sdftrack::tracking {

using Poses = std::vector<std::optional<Rigidd>>;  // T_cam_obj of the caller's object frame

// Two solids are not in one place: at most one of the two poses is right, so neither is sure.
void doubt_overlaps(const std::vector<TrackedObject>& objects, std::vector<ObjectResult>* results);

// A placeholder is followed for a primitive not found yet: whatever is said of it, the primitive is lost.
void mark_unfound(const TrackedObject& object, ObjectResult* result);

// What is said of an object whose pose is open along directions that no declared symmetry explains.
void doubt_open_directions(const TrackedObject& object, ObjectResult* result);

// What is said of an object whose size is surely not that of its model.
void doubt_size(const TrackedObject& object, ObjectResult* result);

// One decision: a pose that is more likely wrong than right is not ok. What a declared symmetry leaves open
// does not count.
void doubt_unlikely(const TrackedObject& object, ObjectResult* result);

Twist twist_between(const Rigidd& before, const Rigidd& now, double elapsed_s);

class Verdict {
 public:
  // A new sequence; last good poses, if any are known.
  void start(Poses best);
  // One goes on that was kept elsewhere: number and time of its last frame, and who was followed in it.
  void resume(int index, double time_s, const std::vector<bool>& followed, Poses best);
  // The frame's number: counted on.
  void next_frame() { ++result_.index; }

  // The objects are others than in the last frame: there is no result to go on from.
  void add(const std::optional<Rigidd>& pose);
  void remove(std::size_t k);
  void interrupt() { last_ = Last::kNone; }
  void set_pose(std::size_t k, const Rigidd& T_cam_obj) { best_.at(k) = T_cam_obj; }

  // Takes the answers about the objects that were served into the frame's result; those about the others are
  // the last frame's. Gives back what was there before.
  void conclude(const std::vector<TrackedObject>& objects, const std::vector<int>& served, double time_s,
                std::vector<ObjectResult>* answers);
  const FrameResult& result() const { return result_; }
  FrameResult& result() { return result_; }
  // Whether the last frame's result is about these objects, as a call that serves some of them needs it.
  bool has_result() const { return last_ == Last::kKnown; }

  int index() const { return result_.index; }
  const Poses& last_good() const { return best_; }

  template <class Archive, class Self>
  static void visit(Archive& archive, Self& self) {
    auto& [result, last, best, followed] = self;
    archive(result);
    archive.choice(last, Last::kKnown);
    archive(best, followed);
    archive.check(last == Last::kNone || followed.size() == best.size());
    archive.check(last != Last::kKnown || result.objects.size() == best.size());
  }

 private:
  enum class Last {
    kNone,
    kResumed,
    kKnown
  };  // frame: none, its time and who was followed, all of its result

  FrameResult result_;
  Last last_ = Last::kNone;
  Poses best_;
  std::vector<bool> followed_;  // in the last frame
};

}  // namespace sdftrack::tracking
