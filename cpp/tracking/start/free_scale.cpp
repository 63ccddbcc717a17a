// SPDX-License-Identifier: MIT
#include "tracking/start/free_scale.h"

#include <cmath>

#include "base/interrupt.h"
#include "tracking/start/size_check.h"

namespace sdftrack::tracking {

namespace {

constexpr int kFits = 6, kFitsOfTrial = 2;               // starts, at most: each estimates the scale anew
constexpr double kOverViews[] = {1.0, 1.2, 1.45, 1.75};  // diameters over the extents of views

// A start of a tracker with free scales, and what it needs.
struct ScaledStart {
  Tracker* tracker;
  const frame::DepthFrame& frame;
  const std::vector<PoseHint>& places;

  // Starts at the places, and again at the poses found, until no scale of `objects` changes. Returns the sum
  // of the log scales that were added.
  double fit(const std::vector<int>& objects, int most) const {
    tracker->start(frame, places);
    double total = 0;
    for (int i = 1; i < most; ++i) {
      check_interrupt();
      bool changed = false;
      for (const int k : objects) {
        if (tracker->last_result().objects[k].trust.status == Status::kLost) continue;
        const double added = tracker->adjust_scale(k);
        changed |= added != 0, total += added;
      }
      if (!changed) break;
      std::vector<PoseHint> there = places;
      for (const int k : objects)
        if (const std::optional<Rigidd>& pose = tracker->last_good_poses()[k]) there[k] = {pose, {}, {}};
      tracker->start(frame, there);
    }
    return total;
  }

  // Gives object k the scale, of those that the extent of its mask allows, that explains the frame best.
  void compare_scales(int k) const {
    const double diameter_m = diameter_of(tracker->shape(k)),
                 seen_m = extent_in(frame, tracker->camera(), places[k].mask.data());
    if (seen_m == 0 || diameter_m == 0) return;
    std::vector<double> log_scales{0};
    for (const double over : kOverViews) log_scales.push_back(std::log(over * seen_m / diameter_m));
    double now = 0, best = 0, most = -1;
    for (const double log_scale : log_scales) {
      tracker->enlarge(k, log_scale - now);
      now = log_scale + fit({k}, kFitsOfTrial);
      const double confidence = tracker->last_result().objects[k].trust.confidence;
      if (confidence > most) most = confidence, best = now;
    }
    tracker->enlarge(k, best - now);
  }
};

}  // namespace

void start_with_free_scales(Tracker* tracker, const frame::DepthFrame& frame,
                            const std::vector<PoseHint>& places) {
  const ScaledStart start{tracker, frame, places};
  std::vector<int> free;
  std::vector<float> voxels_m;
  for (int k = 0; k < tracker->object_count(); ++k) {
    if (!tracker->has_free_scale(k)) continue;
    free.push_back(k), voxels_m.push_back(tracker->shape(k).sdf.voxel_m);
  }
  if (frame.depth_m.data)
    for (const int k : free)
      if (!places[k].mask.empty()) start.compare_scales(k);
  start.fit(free, kFits);
  for (std::size_t i = 0; i < free.size(); ++i)
    if (tracker->shape(free[i]).sdf.voxel_m != voxels_m[i]) {
      tracker->start(frame, places);
      return;
    }
}

}  // namespace sdftrack::tracking
