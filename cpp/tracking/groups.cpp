// SPDX-License-Identifier: MIT
// Objects that may touch or hide each other: fitted together, and one by one where that does not convince.
#include <algorithm>

#include "tracking/tracker.h"

namespace sdftrack {

namespace {

constexpr int kCarriedFrames = 5;  // in which a hidden object is taken along by the others
constexpr int kRounds = 2;         // of fitting together, mending single ones and fitting together again

// Whether the sensor sees past the place of an object that nothing shows: then it is not hidden but gone.
bool seen_through(const Visibility& seen) { return seen.farther > seen.nearer + seen.agree; }

}  // namespace

// together_ holds what is fitted here; objects that are alone are fitted later, on their own.
void Tracker::fit_groups(const DepthFrame& frame) {
  together_.assign(objects_.size(), std::nullopt);
  if (objects_.size() < 2) return;
  find_groups(frame.time_s);
  if (!readable(frame)) return;
  for (std::size_t g = 0; g < group_count_; ++g) fit_group(frame, &groups_[g]);
}

// Connected sets of two and more: the first group_count_ of groups_.
void Tracker::find_groups(double time_s) {
  group_count_ = 0, expected_.clear();
  for (const Object& object : objects_) {
    const bool placed = object.wanted && object.wanted->T_cam_obj;
    expected_.push_back(placed ? centred(*object.wanted->T_cam_obj, *object.shape)
                               : expected_pose(object, time_s));
  }
  visited_.assign(objects_.size(), 0);
  for (std::size_t first = 0; first < objects_.size(); ++first) {
    if (visited_[first] || !objects_[first].placed()) continue;
    if (groups_.size() == group_count_) groups_.emplace_back();
    std::vector<int>& members = groups_[group_count_];
    members.assign(1, static_cast<int>(first));
    visited_[first] = 1;
    for (std::size_t next = 0; next < members.size(); ++next) {
      const auto a = static_cast<std::size_t>(members[next]);
      for (std::size_t b = 0; b < objects_.size(); ++b) {
        if (visited_[b] || !objects_[b].placed() ||
            !may_touch(*objects_[a].shape, expected_[a], *objects_[b].shape, expected_[b]))
          continue;
        visited_[b] = 1;
        members.push_back(static_cast<int>(b));
      }
    }
    std::sort(members.begin(), members.end());
    if (members.size() > 1) ++group_count_;
  }
}

// Of starts in one place the first alone is fitted.
void Tracker::refuse_doubles(std::vector<int>* members) {
  std::size_t kept = 0;
  others_.clear();
  for (const int k : *members) {
    const auto i = static_cast<std::size_t>(k);
    const Rigidd& T_cam_obj = expected_[i];
    int inside = -1;
    for (std::size_t j = 0; objects_[i].wanted && j < kept; ++j)
      if (middle_in(others_[j], *objects_[i].shape, T_cam_obj)) inside = (*members)[j];
    if (inside >= 0) {
      JointFitted& refused = together_[i].emplace();
      refused.fitted.T_cam_obj = T_cam_obj;
      refused.inside = inside;
      continue;
    }
    others_.push_back(field_of(*objects_[i].shape, T_cam_obj));
    (*members)[kept++] = k;
  }
  members->resize(kept);
}

void Tracker::fit_group(const DepthFrame& frame, std::vector<int>* group) {
  refuse_doubles(group);
  const std::vector<int>& members = *group;
  fit_together(frame, members);
  for (int round = 1; round < kRounds && mend_group(frame, members); ++round) fit_together(frame, members);
  tell_apart(members);
}

// Of two that ended in one place the one with fewer readings of its own is lost.
void Tracker::tell_apart(const std::vector<int>& members) {
  const auto pixels = [&](int k) {
    const JointFitted& joint = *together_[static_cast<std::size_t>(k)];
    return joint.hidden || joint.fitted.steps.empty() ? 0 : joint.fitted.steps.back().pixels;
  };
  for (const int a : members)
    for (const int b : members) {
      const auto i = static_cast<std::size_t>(a), j = static_cast<std::size_t>(b);
      if (a == b || together_[i]->inside >= 0 || together_[j]->inside >= 0) continue;
      const SingleObject<float> other = field_of(*objects_[j].shape, together_[j]->fitted.T_cam_obj);
      if (!middle_in(other, *objects_[i].shape, together_[i]->fitted.T_cam_obj)) continue;
      const bool b_goes = pixels(b) < pixels(a);
      together_[b_goes ? j : i]->inside = b_goes ? a : b;
    }
}

std::vector<std::pair<int, int>> Tracker::overlaps(const std::vector<int>& of) const {
  std::vector<std::pair<int, int>> found;
  for (const int k : of) {
    const Object& object = objects_.at(static_cast<std::size_t>(k));
    const SingleObject<float> field = field_of(*object.shape, object.T_cam_obj);
    for (const int j : of) {
      const Object& other = objects_.at(static_cast<std::size_t>(j));
      if (j != k && middle_in(field, *other.shape, other.T_cam_obj)) found.emplace_back(k, j);
    }
  }
  return found;
}

void Tracker::fit_together(const DepthFrame& frame, const std::vector<int>& members) {
  targets_.clear();
  for (const int k : members) {
    const auto i = static_cast<std::size_t>(k);
    targets_.push_back(target_of(frame, objects_[i], expected_[i]));
  }
  std::vector<JointFitted>& fitted = joint_.fit(frame, camera_, targets_, plane_.plane());
  for (std::size_t m = 0; m < members.size(); ++m) {
    std::optional<JointFitted>& kept = together_[static_cast<std::size_t>(members[m])];
    if (kept) prepend(kept->fitted.steps, &fitted[m].fitted.steps);
    kept = std::move(fitted[m]);
    fitted[m].fitted.steps = fitter_.spare_steps();
  }
}

// Single objects that do not look as they used to are looked for nearby, in what the others leave. Whether
// one was found at another place, from which the next round begins.
bool Tracker::mend_group(const DepthFrame& frame, const std::vector<int>& members) {
  bool moved = false;
  for (const int k : members) {
    const auto i = static_cast<std::size_t>(k);
    JointFitted& joint = *together_[i];
    if (joint.hidden || convincing(joint.fitted, objects_[i], options_)) continue;
    const Rigidd before = joint.fitted.T_cam_obj;
    beside_ = others_than(objects_[i]);
    std::optional<Fitted> better =
        further_fits(without_others(frame, members, k), objects_[i], expected_[i], std::move(joint.fitted));
    beside_ = nullptr;
    joint.fitted = std::move(*better);
    const Vec3d away = joint.fitted.T_cam_obj.t - before.t;
    const bool changed = norm(away) > 1e-9;
    moved |= changed;
    if (changed) expected_[i] = joint.fitted.T_cam_obj;
  }
  return moved;
}

// The frame without the readings that are on other members' surfaces.
DepthFrame Tracker::without_others(const DepthFrame& frame, const std::vector<int>& members, int k) {
  taken_.assign(static_cast<std::size_t>(camera_.width) * static_cast<std::size_t>(camera_.height), 0);
  for (const int m : members) {
    const auto i = static_cast<std::size_t>(m);
    if (m == k || together_[i]->hidden) continue;
    mark_explained(frame, *objects_[i].shape, together_[i]->fitted.T_cam_obj);
  }
  return not_taken(frame, taken_.data());
}

ObjectResult Tracker::followed_together(const DepthFrame& frame, JointFitted* joint, Object* object) {
  object->prior.reset();
  if (joint->inside >= 0) {
    ObjectResult gone =
        without_pose(*object, "it stands where another is tracked: object " + std::to_string(joint->inside),
                     Status::kLost);
    gone.steps = std::move(joint->fitted.steps);
    return gone;
  }
  if (joint->hidden) {
    if (seen_through(joint->fitted.seen) || ++object->hidden_frames > kCarriedFrames) {
      ObjectResult gone = without_pose(*object, "too few depth readings near the last pose", Status::kLost);
      gone.steps = std::move(joint->fitted.steps);
      return gone;
    }
    ObjectResult carried =
        without_pose(*object, "hidden: placed by its neighbours and its motion", Status::kWeak);
    object->T_cam_obj = joint->fitted.T_cam_obj;
    object->weak = true;
    object->motion.pass();
    carried.T_cam_obj = uncentred(object->T_cam_obj, *object->shape);
    carried.covariance = joint->fitted.covariance;
    carried.steps = std::move(joint->fitted.steps);
    return carried;
  }
  const Trust trust = judge(joint->fitted, options_, object->prior_log_odds);
  return judged(std::move(joint->fitted), trust, frame.time_s, object);
}

}  // namespace sdftrack
