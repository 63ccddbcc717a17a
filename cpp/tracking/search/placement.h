// SPDX-License-Identifier: MIT
// Where an object of a given rotation would be, by a look at what is read: first places of a search.
#pragma once

#include <vector>

#include "tracking/search/proposals.h"

namespace sdftrack::tracking {

// Share of a box in the image that the object's own box covers: a box is drawn about what is seen of it.
double box_coverage(const Camera& camera, const frame::Shape& shape, const Rigidf& T_obj_cam,
                    const frame::Rect& box);

class Placer {
 public:
  Placer(const Camera& camera, const frame::Shape& shape, const SearchScene& scene)
      : camera_(camera), shape_(shape), scene_(scene) {}

  // The rotation and the readings that the next places are for.
  void turn(const Mat3d& R_cam_obj, const Proposal& proposal);

  // The centroid of what the camera would see comes to the centroid of the readings.
  Rigidd on_centroid() const;
  // The same and steps to its sides, each at the depth that most readings ask for.
  const std::vector<Rigidd>& about_centroid();
  // The object's box in the image comes to the middle of the box, and to its edges where it is larger: the
  // rest is hidden.
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
  std::vector<Vec3d> all_;     // of all
  Vec3d centroid_;             // of what the camera would see, from the object's origin, camera axes
  std::vector<Rigidd> places_;
  std::vector<double> beyond_;
};

}  // namespace sdftrack::tracking
