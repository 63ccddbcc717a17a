// SPDX-License-Identifier: MIT
// Directions of a pose that the frame does not determine.
#pragma once

#include <string>
#include <vector>

#include "frame/region.h"
#include "tracking/trust/covariance.h"

namespace sdftrack::tracking {

// Mean of p p^T.
Eigen::Matrix3d square_of(const frame::Moments& moments);

// A motion of the object, as an increment (v, w) of T_obj_cam of the centred frame.
struct OpenDirection {
  Vector6d increment;  // moves the surface by 1 m, root mean square
  Vector6d part;       // part . d: the component of an increment d along it, m
  double sd_m;         // of the pose along this direction

  bool turns(double radius_m) const {
    return increment.tail<3>().norm() * radius_m > increment.head<3>().norm();
  }

  template <class Archive, class Self>
  static void visit(Archive& archive, Self& self) {
    auto& [d, dual, sd] = self;
    archive(d, dual, sd);
  }
};

// Principal directions of a covariance in the metric of the surface's mean square displacement, largest
// first: those with an sd above a fifth of the object's radius (root mean square distance of its surface).
class OpenDirections {
 public:
  OpenDirections() = default;
  // covariance: camera axes, about the caller's object origin; T_cam_obj: centred.
  OpenDirections(const Matrix6d& covariance, const Rigidd& T_cam_obj, const frame::Shape& shape);

  bool empty() const { return all_.empty(); }

  template <class Archive, class Self>
  static void visit(Archive& archive, Self& self) {
    auto& [directions, radius] = self;
    archive(directions, radius);
  }

  // Information of a prior that holds the pose along these directions: a random walk of kRest_m per frame
  // where nothing is observed, of half the sd where a little is.
  Matrix6d hold() const;
  // Removes from a velocity (v of the centre, w) in camera axes its part along these directions.
  void remove_from(const Rigidd& T_cam_obj, Vec3d* v, Vec3d* w) const;

  // One sentence about the directions that no declared symmetry (motions of the centred frame) explains;
  // empty: none. turns_are_free: turns of a solid known to be one of revolution have no meaning.
  std::string unexplained(const std::vector<Rigidd>& symmetries, bool turns_are_free) const;

 private:
  std::vector<OpenDirection> all_;
  double radius_m_ = 0;
};

// For a shape fused from the frames themselves: mean of J J^T (d phi / d increment of T_obj_cam) over the
// surface points measured in the frame, within tolerance_m, at T_cam_obj (centred), by smooth normals. Turns
// are multiplied by half the shape's diameter over that of its seen part. The shape's bumps hold the pose at
// which they were fused, however the object moves.
Matrix6d seen_form(const frame::DepthFrame& frame, const Camera& camera, const frame::Shape& shape,
                   const Rigidd& T_cam_obj, double tolerance_m);

// Root mean square slope of a form that is surely not noise, a turn taken at half the diameter. Fused bodies
// of revolution have at most this, six-sided prisms 0.07 to 0.10, boxes and mugs more.
double least_form_slope(const frame::Shape& shape);

}  // namespace sdftrack::tracking
