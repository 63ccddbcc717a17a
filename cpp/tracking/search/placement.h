// SPDX-License-Identifier: MIT
// First places of a search: where an object of a given rotation would be, by the depth measurements.
#pragma once

#include <vector>

#include "tracking/search/proposals.h"

namespace sdftrack::tracking {

// Share of a box in the image that the object's own box covers: a box is drawn around the visible part.
double box_coverage(const Camera& camera, const frame::Shape& shape, const Rigidf& T_obj_cam,
                    const frame::Rect& box);

class Placer {
 public:
  Placer(const Camera& camera, const frame::Shape& shape, const SearchScene& scene)
      : camera_(camera), shape_(shape), scene_(scene) {}

  // Sets the rotation and the measurements for the next places.
  void turn(const Mat3d& R_cam_obj, const Proposal& proposal);

  // Puts the centroid of the part that the camera would see onto the centroid of the measurements.
  Rigidd on_centroid() const;
  // The same place and steps to its sides, each at the depth that most measurements support.
  const std::vector<Rigidd>& about_centroid();
  // Puts the object's box in the image onto the middle of the given box, and to its edges where the object's
  // box is larger: the rest is hidden.
  const std::vector<Rigidd>& in_box(const frame::Rect& box);

 private:
  struct Bounds {
    double low[2], high[2];  // x / z, y / z
  };
  Bounds bounds(const Rigidd& T) const;
  void settle_depth(Rigidd* T);

  const Camera& camera_;
  const frame::Shape& shape_;
  const SearchScene& scene_;
  const Proposal* proposal_ = nullptr;
  Mat3d R_;
  std::vector<Vec3d> facing_;  // R p of surface points that face the camera
  std::vector<Vec3d> all_;     // the same of all points
  Vec3d centroid_;             // of the part that the camera would see, from the object's origin, camera axes
  std::vector<Rigidd> places_;
  std::vector<double> beyond_;
};

}  // namespace sdftrack::tracking
