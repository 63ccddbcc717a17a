// SPDX-License-Identifier: MIT
// The final result of a frame: the parts' results, made consistent with one another and earlier frames.
#pragma once

#include <optional>
#include <vector>

#include "tracking/result.h"

namespace sdftrack::tracking {

using Poses = std::vector<std::optional<Rigidd>>;  // T_cam_obj of the caller's object frame

// Two solids cannot be in one place: at most one of the two poses is right, so neither is sure.
void doubt_overlaps(const std::vector<TrackedObject>& objects, std::vector<ObjectResult>* results);

// A placeholder is followed for a primitive not found yet: whatever its result, the primitive is lost.
void mark_unfound(const TrackedObject& object, ObjectResult* result);

// Reports a pose that is open along directions that no declared symmetry explains.
void doubt_open_directions(const TrackedObject& object, ObjectResult* result);

// Reports a size that surely differs from that of the model.
void doubt_size(const TrackedObject& object, ObjectResult* result);

// A pose that is more likely wrong than right is not ok, nor are the poses after it until one is clearly
// likely: the errors of successive frames are alike, so that two frames are hardly more evidence than one.
// Directions left open by a declared symmetry do not count.
void doubt_unlikely(TrackedObject* object, ObjectResult* result);

// Of the poses equivalent by the object's symmetry, the result gets the one nearest to the last reported one,
// with its covariances and twist about the origin there.
void report_nearest(TrackedObject* object, ObjectResult* result);

Twist twist_between(const Rigidd& before, const Rigidd& now, double elapsed_s);

class Verdict {
 public:
  // Starts a new sequence, with the last good poses if any are known.
  void start(Poses best);
  // Resumes a sequence: number and time of its last frame, and which objects were followed in it.
  void resume(int index, double time_s, const std::vector<bool>& followed, Poses best);
  // Increments the frame's number.
  void next_frame() { ++result_.index; }

  // The set of objects has changed since the last frame: there is no previous result to continue from.
  void add(const std::optional<Rigidd>& pose);
  void remove(std::size_t k);
  void interrupt() { last_ = Last::kNone; }
  void set_pose(std::size_t k, const Rigidd& T_cam_obj) { best_.at(k) = T_cam_obj; }

  // Swaps the results of the served objects into the frame's result, where the others keep those of the last
  // frame. `latest` then holds the previous results.
  void conclude(std::vector<TrackedObject>* objects, const std::vector<int>& served, double time_s,
                std::vector<ObjectResult>* latest);
  const FrameResult& result() const { return result_; }
  FrameResult& result() { return result_; }
  // Whether the last frame's result is about these objects; a call that serves only some of them needs it.
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
  };  // about the last frame: nothing, its time and the followed objects, its whole result

  FrameResult result_;
  Last last_ = Last::kNone;
  Poses best_;
  std::vector<bool> followed_;  // in the last frame
};

}  // namespace sdftrack::tracking
