// SPDX-License-Identifier: MIT
#include "tracking/tracker.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <stdexcept>
#include <utility>

#include "tracking/option_schema.h"

namespace sdftrack {

namespace {

constexpr int kColorBudget = 1500, kFirstColorBudget = 20000;  // pixels visited for the histograms

// `first`: where a reading is likely.
bool has_depth(const ImageView<float>& depth_m, int first) {
  const int pixels = depth_m.width * depth_m.height, stride = std::max(1, pixels / 4099);
  if (depth_m.data[first] > 0) return true;
  for (int i = 0; i < pixels; i += stride)
    if (depth_m.data[i] > 0) return true;
  return false;
}

// The pixel of the object's centre, or one at the border.
int pixel_of(const Camera& camera, const Rigidd& T_cam_obj) {
  const Vec2d u = T_cam_obj.t.z > 0 ? camera.project_point(T_cam_obj.t) : Vec2d{0, 0};
  const auto at = [](double v, int n) { return static_cast<int>(std::clamp(v, 0.0, n - 1.0)); };
  return at(u.y, camera.height) * camera.width + at(u.x, camera.width);
}

// Within the mask, if there is one.
bool has_reading(const ImageView<float>& depth_m, const std::vector<unsigned char>& mask) {
  for (std::size_t i = 0; i < mask.size(); ++i)
    if (mask[i] && depth_m.data[i] > 0) return true;
  return mask.empty();
}

}  // namespace

Tracker::Tracker(const std::vector<SdfView>& shapes, const Camera& camera, const TrackerOptions& options,
                 const TrackerSettings& settings)
    : options_(check_options(options)),
      settings_(settings),
      device_(settings.cuda ? std::make_unique<CudaWork>() : nullptr),
      fitter_(options, settings.threads, device_.get()),
      joint_(options, settings.collision, settings.threads),
      finder_(options, settings.threads) {
  for (const SdfView& sdf : shapes) {
    objects_.push_back(new_object(sdf));
  }
  set_camera(camera);
}

DepthFrame Tracker::make_frame(const ImageView<float>& depth_m, const unsigned char* mask, double time_s,
                               const ColorImage* color) const {
  return {depth_m, mask, rays_.empty() ? nullptr : rays_.data(), time_s, color};
}

const std::vector<ObjectResult>& Tracker::start(const DepthFrame& frame,
                                                const std::vector<Whereabouts>& places) {
  if (places.size() != objects_.size())
    throw std::invalid_argument("poses: expected one per shape (" + std::to_string(objects_.size()) +
                                "), got " + std::to_string(places.size()));
  plane_ = {};
  for (std::size_t k = 0; k < objects_.size(); ++k) {
    objects_[k].forget(options_.damping_start);
    objects_[k].colors.forget();
    const std::optional<Rigidd>& pose = places[k].T_cam_obj;  // the plane's search leaves its region out
    objects_[k].T_cam_obj = pose ? centred(*pose, *objects_[k].shape) : Rigidd{};
    objects_[k].wanted = places[k];
  }
  return track(frame);
}

const std::vector<ObjectResult>& Tracker::track(const DepthFrame& frame) {
  everyone_.resize(objects_.size());
  std::iota(everyone_.begin(), everyone_.end(), 0);
  fit_groups(frame);
  return each(frame, everyone_, [&](std::size_t, Object* o) { return track_one(frame, o); });
}

const std::vector<ObjectResult>& Tracker::recover(const DepthFrame& frame, const std::vector<int>& objects,
                                                  const std::vector<Whereabouts>& places) {
  together_.clear();
  return each(frame, objects, [&](std::size_t i, Object* object) {
    object->forget(options_.damping_start);
    return begin_at(frame, object, places[i]);
  });
}

std::optional<Fitted> Tracker::look(const DepthFrame& frame, int k, const Rigidd& T_cam_obj) {
  const Shape& shape = *objects_.at(static_cast<std::size_t>(k)).shape;
  return fitter_.look(frame, camera_, {shape, centred(T_cam_obj, shape), Matrix6d::Zero(), {}});
}

template <class Work>
const std::vector<ObjectResult>& Tracker::each(const DepthFrame& frame, const std::vector<int>& objects,
                                               const Work& work) {
  const bool has_readings = readable(frame);
  if (has_readings && options_.drop_plane) follow_plane(frame);
  for (ObjectResult& old : results_) fitter_.give_back(std::move(old.steps));
  results_.resize(objects.size());
  // First those whose place is known, so that a search for the others leaves their readings alone.
  order_.clear();
  for (const bool placed : {true, false})
    for (std::size_t i = 0; i < objects.size(); ++i)
      if (objects_.at(static_cast<std::size_t>(objects[i])).placed() == placed) order_.push_back(i);
  for (const std::size_t i : order_) {
    Object& object = objects_.at(static_cast<std::size_t>(objects[i]));
    if (!has_readings) {
      results_[i] = unread(&object);
      continue;
    }
    const bool color_used = colors_of(frame, object) != nullptr;
    results_[i] = work(i, &object);
    results_[i].color_used = color_used;
    if (results_[i].trust.status == Status::kOk) learn_colors(frame, &object);
  }
  // Then the searches, when all that can be followed has its place.
  for (const std::size_t i : order_) {
    Object& object = objects_.at(static_cast<std::size_t>(objects[i]));
    if (std::exchange(object.to_search, false))
      results_[i] = look_for(frame, &object, std::move(results_[i]));
  }
  if (has_readings && objects_.size() > 1) tell_finds_apart(objects);
  for (std::size_t i = 0; i < objects.size(); ++i)
    doubt_identity(static_cast<std::size_t>(objects[i]), &results_[i]);
  return results_;
}

bool Tracker::readable(const DepthFrame& frame) const {
  return has_depth(frame.depth_m, objects_.empty() ? 0 : pixel_of(camera_, objects_.front().T_cam_obj));
}

ObjectResult Tracker::unread(Object* object) {
  // A place to begin at is kept for the next frame; a pose is one already.
  if (object->wanted && object->wanted->T_cam_obj)
    object->T_cam_obj = centred(*object->wanted->T_cam_obj, *object->shape), object->wanted.reset();
  return without_pose(*object, "the depth image has no valid reading", Status::kBadFrame);
}

void Tracker::follow_plane(const DepthFrame& frame) {
  std::vector<Rect> regions;
  for (const Object& object : objects_)
    regions.push_back(projected_box(camera_, *object.shape, object.T_cam_obj, options_.padding_m));
  plane_.update(frame, camera_, regions);
}

const ColorModel* Tracker::colors_of(const DepthFrame& frame, const Object& object) const {
  const bool tell =
      frame.color && object.colors.known() && object.colors.overlap() <= options_.color_max_overlap;
  return tell ? &object.colors : nullptr;
}

// Only from a pose that is sure: from another it would learn the colours of what hides the object, or of what
// was taken for it, and these would speak for that pose from then on.
void Tracker::learn_colors(const DepthFrame& frame, Object* object) {
  if (!frame.color || object->prior_log_odds < 0) return;
  const int budget = object->colors.known() ? kColorBudget : kFirstColorBudget;
  count_colors(frame, camera_, *object->shape, object->T_cam_obj, options_.padding_m, budget, object->colors,
               &color_reader_, &color_counts_, *others_than(*object));
  object->colors.update(color_counts_, options_.color_object_rate, options_.color_background_rate);
}

ObjectResult Tracker::track_one(const DepthFrame& frame, Object* object) {
  if (object->wanted) {
    const Whereabouts place = std::move(*object->wanted);
    object->wanted.reset();
    return begin_at(frame, object, place);
  }
  ObjectResult result = confirmed(follow(frame, object), object);
  if (result.trust.status != Status::kLost) {
    object->lost_frames = 0;
    return result;
  }
  ++object->lost_frames;
  object->motion.reset();
  object->to_search = settings_.recover;
  return result;
}

ObjectResult Tracker::begin_at(const DepthFrame& frame, Object* object, const Whereabouts& place) {
  if (place.T_cam_obj) {
    object->T_cam_obj = centred(*place.T_cam_obj, *object->shape);
    return follow(frame, object);
  }
  SearchQuery query;
  query.mask = place.mask.empty() ? nullptr : place.mask.data();
  query.box = place.box;
  // Whoever gives a mask or a box knows that it is there.
  object->prior_log_odds = query.mask || query.box ? 0 : std::log(options_.search_odds);
  query.plane = plane_.plane();
  query.taken = taken_by_others(frame, *object);
  query.others = others_than(*object);
  const std::optional<Found> found =
      finder_.find(not_taken(frame, query.taken), camera_, *object->shape, object->memory,
                   colors_of(frame, *object), query, object->prior_log_odds, &fitter_);
  if (!found) {
    object->lost_frames = 1;
    return without_pose(*object,
                        has_reading(frame.depth_m, place.mask) ? "nothing was found that could be the object"
                                                               : "no depth reading within the mask",
                        Status::kLost);
  }
  ObjectResult result = judged(found->fitted, found->trust, frame.time_s, object);
  result.runner_up = found->runner_up;
  object->lost_frames = result.trust.status == Status::kLost;
  return result;
}

}  // namespace sdftrack
