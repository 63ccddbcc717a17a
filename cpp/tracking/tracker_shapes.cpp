// SPDX-License-Identifier: MIT
// Which shapes a tracker follows, by which camera, and from where.
#include <utility>

#include "tracking/tracker.h"

namespace sdftrack {

TrackedObject Tracker::new_object(const SdfView& sdf) const {
  Object object;
  object.shape = shape_of(sdf);
  object.colors = ColorModel(static_cast<float>(options_.color_prior));
  object.forget(options_.damping_start);
  return object;
}

std::shared_ptr<const Shape> Tracker::shape_of(const SdfView& sdf) const {
  for (const Object& object : objects_)
    if (object.shape->sdf.phi == sdf.phi && !object.shape->colors.rgb_seen) return object.shape;
  return std::make_shared<const Shape>(
      make_shape(sdf, 3 * options_.trust_points, options_.free_space_points));
}

void Tracker::reshape(int k, PartialShape known) {
  Object& object = objects_.at(static_cast<std::size_t>(k));
  known.centre_obj = object.shape->centre_obj;  // what is remembered of the motion is about it
  object.shape =
      std::make_shared<const Shape>(make_shape(known, 3 * options_.trust_points, options_.free_space_points));
}

void Tracker::paint(int k, const ColorView& colors) {
  Object& painted = objects_.at(static_cast<std::size_t>(k));
  for (const Object& other : objects_)
    if (other.shape->sdf.phi == painted.shape->sdf.phi && other.shape->colors.rgb_seen == colors.rgb_seen) {
      painted.shape = other.shape;
      return;
    }
  Shape shape = *painted.shape;
  shape.colors = colors;
  painted.shape = std::make_shared<const Shape>(std::move(shape));
}

void Tracker::set_camera(const Camera& camera) {
  camera_ = camera;
  rays_ = camera.distorted() ? ray_table(camera) : std::vector<float>{};
}

void Tracker::set_pose(int k, const Rigidd& T_cam_obj, const std::optional<Matrix6d>& covariance_cam) {
  Object& object = objects_.at(static_cast<std::size_t>(k));
  object.T_cam_obj = centred(T_cam_obj, *object.shape);
  object.motion.reset();
  object.lost_frames = 0;
  object.wanted.reset(), object.before_found.reset(), object.prior.reset();
  if (covariance_cam)
    object.prior = increment_information(*covariance_cam, object.T_cam_obj, -object.shape->centre_obj);
}

int Tracker::add(const SdfView& shape, const Whereabouts& place) {
  Object object = new_object(shape);
  if (place.T_cam_obj) object.T_cam_obj = centred(*place.T_cam_obj, *object.shape);
  object.wanted = place;
  objects_.push_back(std::move(object));
  return object_count() - 1;
}

void Tracker::remove(int k) {
  objects_.at(static_cast<std::size_t>(k));
  objects_.erase(objects_.begin() + k);
}

}  // namespace sdftrack
