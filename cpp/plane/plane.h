// SPDX-License-Identifier: MIT
// The dominant plane of a depth image: a table or a floor (thesis, section 3.8 and Fig. 3.15;
// docs/math/planes.md).
#pragma once

#include <algorithm>
#include <optional>
#include <vector>

#include "plane/plane_fit.h"

namespace sdftrack::plane {

// What is done with the patch that starts a plane.
enum class PlaneMethod {
  kPrinted,  // extended as it is (thesis)
  kRigid,    // refitted to all readings near it
  kBent,     // and bent by a little (a lens's depth distortion)
};

struct PlaneOptions {
  double tolerance_m = 0.01;
  int start_x = -1, start_y = -1;      // a pixel on the plane; -1: search
  std::vector<frame::Rect> leave_out;  // regions whose readings do not vote (tracked objects)
  PlaneMethod method = PlaneMethod::kRigid;
  DepthNoise noise;
};

// Why there is no plane.
enum class PlaneMiss { kNone, kFewReadings, kNoStart, kStartNotFlat, kSmall };

struct FoundPlane {
  InversePlane plane;
  double noise_scale = 1;  // the measured noise over the law's
  double share = 0;        // of the readings that lie on it
  PlaneMiss miss = PlaneMiss::kNone;
};

// From a patch at the start pixel, or the best of many all over the image; of parallel ones close together
// the one behind (not the top of a box on a table). A miss when no plane holds a tenth of the readings.
FoundPlane search_plane(const frame::DepthFrame& frame, const Camera& camera, const PlaneOptions& options);

// The same without the reasons. The normal points to the camera.
std::optional<frame::Plane> find_plane(const frame::DepthFrame& frame, const Camera& camera,
                                       const PlaneOptions& options);

// Half the thickness of a plane in readings at a depth: noise of a depth sensor grows with the square.
inline double plane_tolerance_m(double tolerance_m, double depth_m) {
  return tolerance_m * std::max(1.0, depth_m * depth_m);
}

// The plane that most of some points lie on, if it holds `min_share` of them and is `extent_m` wide:
// the best of `seeds` triples that lie apart, refitted. Tolerance at 1 m.
std::optional<frame::Plane> plane_among(const std::vector<Vec3d>& points, double tolerance_m, int seeds,
                                        double min_share, double extent_m);

// The plane from frame to frame: followed where it still holds, searched for anew now and then where not.
class PlaneFollower {
 public:
  void update(const frame::DepthFrame& frame, const Camera& camera, const std::vector<frame::Rect>& objects);
  const frame::Plane* plane() const { return plane_ ? &*plane_ : nullptr; }

  template <class Archive, class Self>
  static void visit(Archive& archive, Self& self) {
    auto& [plane, grid, to_search] = self;
    archive(plane, to_search);
  }

 private:
  std::optional<frame::Plane> plane_;
  PlaneGrid grid_;
  int frames_to_search_ = 0;
};

}  // namespace sdftrack::plane
