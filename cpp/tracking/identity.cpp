// SPDX-License-Identifier: MIT
#include "tracking/identity.h"

#include <algorithm>
#include <utility>

namespace sdftrack::tracking {

namespace {

constexpr double kAlike = 0.7;      // ratio of two travels from which either may be the right one
constexpr int kDoubtfulFrames = 5;  // for which the doubt is reported

// An object of the tracker that the current call serves.
struct Served {
  int number;
  TrackedObject& object;
  ObjectResult& result;
};

// How far an object has moved. Its turn does not count: a symmetric object may be found either way round.
double travel_m(const Rigidd& from, const Rigidd& to) { return norm(to.t - from.t); }

// Whether either of two travels may be the right one.
bool alike(double a_m, double b_m) { return std::min(a_m, b_m) >= kAlike * std::max(a_m, b_m); }

void doubt(TrackedObject* object, int other) {
  object->doubtful_frames = kDoubtfulFrames;
  object->double_of = other;
}

// Whether both have the same volume, or volumes made of the same mesh.
bool look_alike(const TrackedObject& a, const TrackedObject& b) {
  const frame::Shape &s = *a.shape, &t = *b.shape;
  return a.shape == b.shape || (s.sdf.voxel_m == t.sdf.voxel_m && s.diameter_m == t.diameter_m &&
                                s.depth_m == t.depth_m && s.contact.size() == t.contact.size());
}

// Assigns the finds of two look-alikes as they came or exchanged, whichever gives the shorter travel in sum.
void exchange_finds(const Served& one, const Served& two) {
  TrackedObject &a = one.object, &b = two.object;
  const Rigidd last_a = *a.before_found, last_b = *b.before_found;
  const double kept = travel_m(last_a, a.T_cam_obj) + travel_m(last_b, b.T_cam_obj);
  const double exchanged = travel_m(last_a, b.T_cam_obj) + travel_m(last_b, a.T_cam_obj);
  if (exchanged < kept) {
    std::swap(one.result, two.result);
    std::swap(a.T_cam_obj, b.T_cam_obj);
    std::swap(a.memory, b.memory);
  }
  if (alike(kept, exchanged)) doubt(&a, two.number), doubt(&b, one.number);
}

// `to` is still lost and was nearer: the find belongs to it, and the search for `from` continues.
void hand_over_find(const Served& from, const Served& to) {
  TrackedObject &a = from.object, &b = to.object;
  const double own_m = travel_m(*a.before_found, a.T_cam_obj), other_m = travel_m(b.T_cam_obj, a.T_cam_obj);
  if (alike(own_m, other_m)) doubt(&a, to.number);
  if (other_m >= own_m) return;
  ObjectResult gone = std::move(to.result);
  to.result = std::move(from.result);
  b.before_found = b.T_cam_obj;
  b.T_cam_obj = a.T_cam_obj, b.memory = a.memory, b.weak = a.weak;
  b.prior_log_odds = a.prior_log_odds, b.lost_frames = 0;
  if (a.doubtful_frames > 0) doubt(&b, from.number), a.doubtful_frames = 0;
  a.T_cam_obj = *a.before_found;
  a.before_found.reset();
  a.lost_frames = 1;
  gone.T_cam_obj = uncentred(a.T_cam_obj, *a.shape);
  from.result = std::move(gone);
}

}  // namespace

void assign_finds(const std::vector<int>& served, std::vector<TrackedObject>* objects,
                  std::vector<ObjectResult>* results) {
  const auto at = [&](std::size_t i) -> Served { return {served[i], (*objects)[served[i]], (*results)[i]}; };
  for (std::size_t i = 0; i < served.size(); ++i) {
    const Served one = at(i);
    if (!one.object.before_found) continue;
    for (std::size_t j = 0; j < served.size(); ++j) {
      const Served two = at(j);
      if (i == j || !look_alike(one.object, two.object)) continue;
      if (two.object.before_found && i < j)
        exchange_finds(one, two);
      else if (two.object.lost_frames > 1)
        hand_over_find(one, two);
      if (!one.object.before_found) break;
    }
  }
}

void doubt_identity(TrackedObject* object, ObjectResult* result) {
  if (object->doubtful_frames == 0 || !is_followed(result->trust.status)) return;
  --object->doubtful_frames;
  result->trust.status = Status::kWeak;
  result->trust.confidence *= 0.5;  // either of two is possible
  result->trust.reason = reason_about(ReasonCode::kMaybeExchanged, object->double_of);
}

}  // namespace sdftrack::tracking
