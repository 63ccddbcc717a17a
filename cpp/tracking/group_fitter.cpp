// SPDX-License-Identifier: MIT
#include "tracking/group_fitter.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "tracking/several/play.h"

namespace sdftrack::tracking {

namespace {

constexpr int kCarriedFrames = 5;  // in which a hidden object need not be held by the others
constexpr double kCarried_m = 0.03, kCarried_rad = 0.3;  // sd per frame of what they do not bound
constexpr int kSpreadFrames = 3;  // after which that grows no further: 6 cm say all there is to say
constexpr int kGroupRounds = 2;   // of a joint fit, repair of single objects and another joint fit

// Whether the sensor sees past the place of an object without evidence: it is then not hidden but gone.
bool seen_through(const Visibility& seen) { return seen.farther > seen.nearer + seen.agree; }

}  // namespace

void GroupFitter::fit(FrameContext* context, const Objects& objects) {
  find_groups(objects, context->frame().time_s);
  if (!context->readable()) return;
  for (std::size_t g = 0; g < group_count_; ++g) fit_group(context, objects, &groups_[g]);
}

// Connected sets of two or more objects: the first group_count_ of groups_.
void GroupFitter::find_groups(const Objects& objects, double time_s) {
  group_count_ = 0, expected_.clear();
  for (const TrackedObject& object : objects) {
    const bool placed = object.requested && object.requested->T_cam_obj;
    expected_.push_back(placed ? centred(*object.requested->T_cam_obj, *object.shape)
                               : follower_->expected_pose(object, time_s));
  }
  visited_.assign(objects.size(), 0);
  for (std::size_t first = 0; first < objects.size(); ++first) {
    if (visited_[first] || !objects[first].placed()) continue;
    if (groups_.size() == group_count_) groups_.emplace_back();
    std::vector<int>& members = groups_[group_count_];
    members.assign(1, int(first));
    visited_[first] = 1;
    for (std::size_t next = 0; next < members.size(); ++next) {
      const auto a = std::size_t(members[next]);
      for (std::size_t b = 0; b < objects.size(); ++b) {
        if (visited_[b] || !objects[b].placed() ||
            !may_touch(*objects[a].shape, expected_[a], *objects[b].shape, expected_[b]))
          continue;
        visited_[b] = 1;
        members.push_back(int(b));
      }
    }
    std::sort(members.begin(), members.end());
    if (members.size() > 1) ++group_count_;
  }
}

void GroupFitter::fit_group(FrameContext* context, const Objects& objects, std::vector<int>* group) {
  refuse_doubles(context, objects, group);
  const std::vector<int>& members = *group;
  fit_together(context, objects, members);
  for (int round = 1; round < kGroupRounds && mend(context, objects, members); ++round)
    fit_together(context, objects, members);
  give_up_doubles(context, objects, members);
  weigh_play(context, objects, members);
}

// How far hidden objects may move between those that are tracked, and whether these hold them.
void GroupFitter::weigh_play(FrameContext* context, const Objects& objects, const std::vector<int>& members) {
  for (const int k : members) {
    const auto i = std::size_t(k);
    JointFitted& hidden = *context->together(i);
    if (!hidden.hidden || hidden.inside >= 0) continue;
    places_.clear();
    for (const int other : members) {
      const auto j = std::size_t(other);
      const JointFitted& one = *context->together(j);
      if (!one.hidden && one.inside < 0 &&
          follower_->judge_followed(one.fitted, objects[j]).status != Status::kLost)
        places_.push_back(field_of(*objects[j].shape, one.fitted.T_cam_obj));
    }
    const double spread = std::sqrt(1.0 + std::min(objects[i].hidden_frames, kSpreadFrames));
    const auto play_at = [&](const Rigidd& T_cam_obj) {
      return play_between(places_, *objects[i].shape, T_cam_obj, spread * kCarried_m, spread * kCarried_rad);
    };
    if (const std::optional<Rigidd> carried = carried_pose(*context, objects, members, i)) {
      const Play play = play_at(*carried);
      if (play.held) {
        hidden.held = true, hidden.fitted.T_cam_obj = *carried, hidden.fitted.covariance = play.covariance;
        continue;
      }
    }
    hidden.fitted.covariance = play_at(hidden.fitted.T_cam_obj).covariance;
  }
}

// The last pose of a hidden object, moved as the nearest of those that are tracked has moved since; none in a
// first frame.
std::optional<Rigidd> GroupFitter::carried_pose(const FrameContext& context, const Objects& objects,
                                                const std::vector<int>& members, std::size_t i) const {
  if (!objects[i].followed()) return std::nullopt;
  std::optional<Rigidd> carried;
  double least_m = std::numeric_limits<double>::infinity();
  for (const int other : members) {
    const auto j = std::size_t(other);
    const JointFitted& one = *context.together(j);
    if (one.hidden || one.inside >= 0 || !objects[j].followed()) continue;
    const Rigidd T_other_cam = inverse(objects[j].T_cam_obj);
    const double gap_m = gap_between({objects[j].shape->sdf, T_other_cam.cast<float>()}, *objects[i].shape,
                                     objects[i].T_cam_obj);
    if (gap_m >= least_m) continue;
    least_m = gap_m;
    carried = one.fitted.T_cam_obj * T_other_cam * objects[i].T_cam_obj;
  }
  return carried;
}

// Of several starts in one place only the first is fitted.
void GroupFitter::refuse_doubles(FrameContext* context, const Objects& objects, std::vector<int>* members) {
  std::size_t kept = 0;
  places_.clear();
  for (const int k : *members) {
    const auto i = std::size_t(k);
    const Rigidd& T_cam_obj = expected_[i];
    int inside = -1;
    for (std::size_t j = 0; objects[i].requested && j < kept; ++j)
      if (middle_in(places_[j], *objects[i].shape, T_cam_obj)) inside = (*members)[j];
    if (inside >= 0) {
      JointFitted& refused = context->together(i).emplace();
      refused.fitted.T_cam_obj = T_cam_obj;
      refused.inside = inside;
      continue;
    }
    places_.push_back(field_of(*objects[i].shape, T_cam_obj));
    (*members)[kept++] = k;
  }
  members->resize(kept);
}

void GroupFitter::fit_together(FrameContext* context, const Objects& objects,
                               const std::vector<int>& members) {
  targets_.clear();
  for (const int k : members) {
    const auto i = std::size_t(k);
    targets_.push_back(follower_->target_of(*context, objects[i], expected_[i], nullptr));
  }
  std::vector<JointFitted>& fitted =
      joint_.fit(context->frame(), context->camera(), targets_, context->plane());
  for (std::size_t m = 0; m < members.size(); ++m) {
    std::optional<JointFitted>& kept = context->together(std::size_t(members[m]));
    if (kept) prepend(kept->fitted.steps, &fitted[m].fitted.steps);
    kept = std::move(fitted[m]);
    fitted[m].fitted.steps = follower_->spare_steps();
  }
}

// Objects that do not match their usual values are searched for nearby, in what the others leave. Returns
// whether one was found at another place, from which the next round starts.
bool GroupFitter::mend(FrameContext* context, const Objects& objects, const std::vector<int>& members) {
  bool moved = false;
  for (const int k : members) {
    const auto i = std::size_t(k);
    JointFitted& joint = *context->together(i);
    if (joint.hidden || convincing(joint.fitted, objects[i], options_)) continue;
    const Rigidd before = joint.fitted.T_cam_obj;
    std::optional<Fitted> better =
        follower_->fit_further(context, context->without_members(members, k), objects[i], expected_[i],
                               &context->neighbors_of(objects[i]), std::move(joint.fitted));
    joint.fitted = std::move(*better);
    const Vec3d away = joint.fitted.T_cam_obj.t - before.t;
    const bool changed = norm(away) > 1e-9;
    moved |= changed;
    if (changed) expected_[i] = joint.fitted.T_cam_obj;
  }
  return moved;
}

// Of two objects that ended in one place, the one with fewer measurements of its own is lost.
void GroupFitter::give_up_doubles(FrameContext* context, const Objects& objects,
                                  const std::vector<int>& members) const {
  const auto pixels = [&](int k) {
    const JointFitted& joint = *context->together(std::size_t(k));
    return joint.hidden || joint.fitted.steps.empty() ? 0 : joint.fitted.steps.back().pixels;
  };
  for (const int a : members)
    for (const int b : members) {
      const auto i = std::size_t(a), j = std::size_t(b);
      JointFitted &one = *context->together(i), &two = *context->together(j);
      if (a == b || one.inside >= 0 || two.inside >= 0) continue;
      const energies::SingleObject<float> other = field_of(*objects[j].shape, two.fitted.T_cam_obj);
      if (!middle_in(other, *objects[i].shape, one.fitted.T_cam_obj)) continue;
      const bool b_goes = pixels(b) < pixels(a);
      (b_goes ? two : one).inside = b_goes ? a : b;
    }
}

ObjectResult GroupFitter::accept(JointFitted* joint, const FrameContext& context,
                                 TrackedObject* object) const {
  object->prior.reset();
  const auto without_pose = [&](Reason reason, Status status) {
    ObjectResult result = result_without_pose(*object, std::move(reason), status);
    result.steps = std::move(joint->fitted.steps);
    return result;
  };
  if (joint->inside >= 0)
    return without_pose(reason_about(ReasonCode::kSamePlace, joint->inside), Status::kLost);
  if (joint->hidden) {
    ++object->hidden_frames;
    const int most = options_.carried_frames;
    const bool over =
        most > 0 ? object->hidden_frames > most : object->hidden_frames > kCarriedFrames && !joint->held;
    if (seen_through(joint->fitted.seen) || over)
      return without_pose({ReasonCode::kFewReadings}, Status::kLost);
    ObjectResult carried = without_pose({ReasonCode::kPlacedByNeighbors}, Status::kWeak);
    object->T_cam_obj = joint->fitted.T_cam_obj;
    object->weak = true;
    object->motion.pass();
    carried.T_cam_obj = uncentred(object->T_cam_obj, *object->shape);
    carried.covariance = joint->fitted.covariance;
    return carried;
  }
  const Trust trust = follower_->judge_followed(joint->fitted, *object);
  return follower_->accept(std::move(joint->fitted), trust, context, object);
}

}  // namespace sdftrack::tracking
