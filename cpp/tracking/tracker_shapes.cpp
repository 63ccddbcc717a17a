// SPDX-License-Identifier: MIT
// The set of shapes that a tracker follows, and their start poses.
#include <cmath>
#include <stdexcept>
#include <utility>

#include "base/portable_math.h"
#include "tracking/options/sensor_noise.h"
#include "tracking/tracker.h"

namespace sdftrack::tracking {

namespace {

std::shared_ptr<const frame::Shape> enlarged_shape(const frame::Shape& shape, double factor) {
  SdfView sdf = shape.sdf;
  auto values = std::make_shared<std::vector<float>>(
      sdf.phi, sdf.phi + static_cast<std::ptrdiff_t>(sdf.nx) * sdf.ny * sdf.nz);
  for (float& phi : *values) phi *= static_cast<float>(factor);
  const Vec3d origin_obj = sdf.origin_obj.cast<double>() + shape.centre_obj;
  sdf.phi = values->data(), sdf.id = 0;
  sdf.voxel_m = static_cast<float>(factor * static_cast<double>(sdf.voxel_m));
  sdf.origin_obj = (factor * origin_obj).cast<float>();
  auto out = std::make_shared<frame::Shape>(frame::make_shape(sdf, kSurfacePoints, kFreeSpacePoints));
  out->values = std::move(values);
  out->colors = shape.colors;  // voxel by voxel
  return out;
}

}  // namespace

Tracker::Tracker(const TrackedObject& object, const Camera& camera, const TrackerOptions& options,
                 const TrackerSettings& settings)
    : Tracker(std::vector<SdfView>(), camera, options, settings) {
  objects_.push_back(new_object(object.shape));
  verdict_.add(std::nullopt);
}

std::unique_ptr<Tracker> Tracker::alone(int k, bool recover) const {
  TrackerSettings settings = settings_;
  settings.recover = settings.recover && recover;
  return std::unique_ptr<Tracker>(new Tracker(object(k), camera(), options_, settings));
}

TrackedObject Tracker::new_object(std::shared_ptr<const frame::Shape> shape) const {
  Object object;
  object.shape = std::move(shape);
  object.colors = appearance::ColorModel(float(options_.color_prior));
  object.outline_colors.forget();
  object.forget(options_);
  return object;
}

std::shared_ptr<const frame::Shape> Tracker::shape_of(const SdfView& sdf) const {
  for (const Object& object : objects_)
    if (object.shape->sdf.phi == sdf.phi && !object.shape->colors.rgb_seen) return object.shape;
  return std::make_shared<const frame::Shape>(frame::make_shape(sdf, kSurfacePoints, kFreeSpacePoints));
}

void Tracker::replace_shapes(const std::vector<SdfView>& shapes, const Poses& poses) {
  if (shapes.size() != objects_.size() || poses.size() != objects_.size())
    throw std::invalid_argument("shapes: expected one per object (" + std::to_string(objects_.size()) +
                                ") with its pose, got " + std::to_string(shapes.size()));
  // All shapes are replaced or none, as one of them may be refused. None is identified with an earlier shape.
  std::vector<Object> before = std::exchange(objects_, {});
  try {
    for (std::size_t k = 0; k < shapes.size(); ++k) {
      objects_.push_back(new_object(shape_of(shapes[k])));
      objects_.back().unfound = before[k].unfound, objects_.back().primitive = before[k].primitive;
      objects_.back().symmetry = before[k].symmetry, objects_.back().symmetries = before[k].symmetries;
      objects_.back().reported = before[k].reported;
      objects_.back().free_scale = before[k].free_scale, objects_.back().log_scale = before[k].log_scale;
    }
  } catch (...) {
    objects_ = std::move(before);
    throw;
  }
  go_on_from(poses);
  context_.forget_plane();
}

void Tracker::set_symmetry(int k, const frame::Symmetry& symmetry) {
  Object& one = object(k);
  const Vec3d c = one.shape->centre_obj;
  one.symmetry = symmetry;
  one.symmetries.clear();
  for (const Rigidd& S : symmetry.motions(frame::kSymmetrySteps)) one.symmetries.push_back({S.R, S * c - c});
  one.symmetries.erase(one.symmetries.begin());  // the identity
}

void Tracker::reshape(int k, frame::PartialShape known) {
  Object& reshaped = object(k);
  known.centre_obj = reshaped.shape->centre_obj;  // the remembered motion is about this centre
  reshaped.shape =
      std::make_shared<const frame::Shape>(frame::make_shape(known, kSurfacePoints, kFreeSpacePoints));
}

double Tracker::adjust_scale(int k) {
  const Object& one = object(k);
  const double log_scale = one.free_scale ? one.size.log_scale_to_add() : 0;
  enlarge(k, log_scale);
  return log_scale;
}

// The knowledge about the object stays; its pose moves so that the measurements remain on its surface.
void Tracker::enlarge(int k, double log_scale) {
  if (log_scale == 0) return;
  Object& one = object(k);
  std::shared_ptr<const frame::Shape> shape = enlarged_shape(*one.shape, std::exp(log_scale));
  const Vector6d by = log_scale * one.size.depth.pull();
  const Rigidd T_obj_cam =
      increment(Vec3d{by[0], by[1], by[2]}, Vec3d{by[3], by[4], by[5]}) * inverse(one.T_cam_obj);
  const double factor = std::exp(log_scale);
  one.symmetry.enlarge(factor);
  for (Rigidd& S : one.symmetries) S.t = factor * S.t;
  for (Alternative& other : one.alternatives) other.motion.t = factor * other.motion.t;
  one.shape = std::move(shape);
  one.size.rescaled(log_scale), one.log_scale += log_scale;
  one.T_cam_obj = inverse(T_obj_cam);
  one.motion.rebase(one.T_cam_obj);
  if (verdict_.last_good()[k]) verdict_.set_pose(std::size_t(k), uncentred(one.T_cam_obj, *one.shape));
}

std::vector<Rigidd> Tracker::alternative_poses(int k) const {
  const TrackedObject& of = object(k);
  std::vector<Rigidd> poses;
  for (const Alternative& a : of.alternatives) poses.push_back(uncentred(of.T_cam_obj * a.motion, *of.shape));
  return poses;
}

SizeTest::LogScale Tracker::scale(int k) const {
  const Object& one = object(k);
  const double z = one.T_cam_obj.t.z;
  const double error_m = hypotenuse(sensor_systematic_m(options_, z), distance_error_m(options_, z));
  const SizeTest::LogScale left = one.size.free_scale();
  return {one.log_scale + left.mean, hypotenuse(left.sd, error_m / z)};
}

void Tracker::paint(int k, const energies::ColorView& colors) {
  Object& painted = object(k);
  for (const Object& other : objects_)
    if (other.shape->sdf.phi == painted.shape->sdf.phi && other.shape->colors.rgb_seen == colors.rgb_seen) {
      painted.shape = other.shape;
      return;
    }
  frame::Shape shape = *painted.shape;
  shape.colors = colors;
  painted.shape = std::make_shared<const frame::Shape>(std::move(shape));
}

// The object counts as followed at this pose.
void Tracker::place(const Rigidd& T_cam_obj, Object* object) const {
  object->T_cam_obj = centred(T_cam_obj, *object->shape);
  object->motion.reset();
  object->lost_frames = 0;
  object->requested.reset(), object->before_found.reset(), object->prior.reset();
}

void Tracker::go_on_from(const Poses& poses) {
  for (std::size_t k = 0; k < objects_.size(); ++k)
    if (poses.at(k)) place({nearest_rotation(poses[k]->R), poses[k]->t}, &objects_[k]);
}

void Tracker::set_pose(int k, const Rigidd& T_cam_obj, const std::optional<Matrix6d>& covariance_cam) {
  Object& moved = object(k);
  place(T_cam_obj, &moved);
  moved.alternatives.clear();
  moved.reported = T_cam_obj;
  if (covariance_cam)
    moved.prior = increment_information(*covariance_cam, moved.T_cam_obj, -moved.shape->centre_obj);
  else
    context_.forget_sequence();  // begun again there; a prior is one more measurement of the same sequence
  verdict_.set_pose(std::size_t(k), T_cam_obj);
}

void Tracker::move_frame(int k, const Rigidd& motion) {
  Object& one = object(k);
  const Rigidd T_cam_obj = uncentred(one.T_cam_obj, *one.shape) * motion;
  const Rigidd centred_motion = inverse(one.T_cam_obj) * centred(T_cam_obj, *one.shape);
  one.T_cam_obj = one.T_cam_obj * centred_motion;
  one.motion.move_frame(centred_motion);
  one.alternatives.clear(), one.before_found.reset(), one.prior.reset();
  one.reported = T_cam_obj;
  verdict_.set_pose(std::size_t(k), T_cam_obj);
}

int Tracker::add(const SdfView& shape, const PoseHint& hint) {
  Object added = new_object(shape_of(shape));
  if (hint.T_cam_obj) added.T_cam_obj = centred(*hint.T_cam_obj, *added.shape);
  added.requested = hint;
  objects_.push_back(std::move(added));
  verdict_.add(hint.T_cam_obj);
  return object_count() - 1;
}

void Tracker::remove(int k) {
  static_cast<void>(object(k));  // throws if there is no such object
  objects_.erase(objects_.begin() + k);
  verdict_.remove(std::size_t(k));
}

void Tracker::resume(int index, double time_s, const std::vector<bool>& followed, const Poses& best) {
  go_on_from(best);
  context_.forget_sequence();
  for (std::size_t k = 0; k < objects_.size(); ++k) objects_[k].reported = best[k];
  verdict_.resume(index, time_s, followed, best);
}

void Tracker::interrupt(int index) {
  context_.forget_sequence();
  verdict_.interrupt();
  verdict_.result().index = index;
}

}  // namespace sdftrack::tracking
