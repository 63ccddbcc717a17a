// SPDX-License-Identifier: MIT
// Which of several look-alikes it is that was found: no picture tells them apart, only where each one was
// last.
#include "tracking/tracker.h"

namespace sdftrack {

namespace {

constexpr double kAlike = 0.7;      // ratio of two travels from which on either may be the right one
constexpr int kDoubtfulFrames = 5;  // in which this is said

// How far the object has come, its turn taken at half its diameter.
double travel_m(const TrackedObject& object, const Rigidd& from, const Rigidd& to) {
  return norm(to.t - from.t) + 0.5 * object.shape->diameter_m * norm(rotation_log(to.R * transpose(from.R)));
}

// The same volume, or one made of the same mesh.
bool look_alike(const TrackedObject& a, const TrackedObject& b) {
  const Shape &s = *a.shape, &t = *b.shape;
  return a.shape == b.shape || (s.sdf.voxel_m == t.sdf.voxel_m && s.diameter_m == t.diameter_m &&
                                s.depth_m == t.depth_m && s.contact.size() == t.contact.size());
}

}  // namespace

// After a frame's searches, over the objects of this call: a find belongs to the object that was last seen
// nearer to it.
void Tracker::tell_finds_apart(const std::vector<int>& objects) {
  const auto object = [&](std::size_t i) -> Object& {
    return objects_[static_cast<std::size_t>(objects[i])];
  };
  for (std::size_t i = 0; i < objects.size(); ++i) {
    if (!object(i).before_found) continue;
    for (std::size_t j = 0; j < objects.size(); ++j) {
      if (i == j || !look_alike(object(i), object(j))) continue;
      if (object(j).before_found && i < j)
        exchange_finds(objects, i, j);
      else if (object(j).lost_frames > 1)
        hand_over_find(objects, i, j);
      if (!object(i).before_found) break;
    }
  }
}

// Two finds of look-alikes: as they came or the other way round, whichever is the shorter way for both.
void Tracker::exchange_finds(const std::vector<int>& objects, std::size_t i, std::size_t j) {
  Object& a = objects_[static_cast<std::size_t>(objects[i])];
  Object& b = objects_[static_cast<std::size_t>(objects[j])];
  const Rigidd last_a = *a.before_found, last_b = *b.before_found;
  const double kept = travel_m(a, last_a, a.T_cam_obj) + travel_m(b, last_b, b.T_cam_obj);
  const double exchanged = travel_m(a, last_a, b.T_cam_obj) + travel_m(b, last_b, a.T_cam_obj);
  if (exchanged < kept) {
    std::swap(results_[i], results_[j]);
    std::swap(a.T_cam_obj, b.T_cam_obj);
    std::swap(a.memory, b.memory);
  }
  if (std::min(kept, exchanged) < kAlike * std::max(kept, exchanged)) return;
  a.doubtful_frames = b.doubtful_frames = kDoubtfulFrames;
  a.double_of = objects[j], b.double_of = objects[i];
}

// `to` is lost still, and was nearer: the find is its own, and `from` is looked for on.
void Tracker::hand_over_find(const std::vector<int>& objects, std::size_t from, std::size_t to) {
  Object& a = objects_[static_cast<std::size_t>(objects[from])];
  Object& b = objects_[static_cast<std::size_t>(objects[to])];
  if (travel_m(b, b.T_cam_obj, a.T_cam_obj) >= kAlike * travel_m(a, *a.before_found, a.T_cam_obj)) return;
  ObjectResult gone = std::move(results_[to]);
  results_[to] = std::move(results_[from]);
  b.before_found = b.T_cam_obj;
  b.T_cam_obj = a.T_cam_obj, b.memory = a.memory, b.weak = a.weak;
  b.prior_log_odds = a.prior_log_odds, b.lost_frames = 0;
  a.T_cam_obj = *a.before_found;
  a.before_found.reset();
  a.lost_frames = 1;
  gone.T_cam_obj = uncentred(a.T_cam_obj, *a.shape);
  results_[from] = std::move(gone);
}

// For a few frames after look-alikes could not be told apart.
void Tracker::doubt_identity(std::size_t k, ObjectResult* result) {
  Object& object = objects_[k];
  if (object.doubtful_frames == 0 || result->trust.status == Status::kLost) return;
  --object.doubtful_frames;
  result->trust.status = Status::kWeak;
  result->trust.confidence *= 0.5;  // it is one of two
  result->trust.reason = "it may have changed places with object " + std::to_string(object.double_of);
}

}  // namespace sdftrack
