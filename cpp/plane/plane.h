// SPDX-License-Identifier: MIT
// The dominant plane of a depth image: a table or a floor (thesis, section 3.8 and Fig. 3.15;
// docs/math/planes.md).
#pragma once

#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

#include "plane/plane_fit.h"

namespace sdftrack::plane {

// How the plane of the first patch is refined.
enum class PlaneMethod {
  kPrinted,  // extended unchanged (thesis)
  kRigid,    // refitted to all measurements near it
  kBent,     // also bent slightly (a lens's depth distortion)
};

struct PlaneOptions {
  double tolerance_m = 0.01;
  int start_x = -1, start_y = -1;      // a pixel on the plane; -1: search
  std::vector<frame::Rect> leave_out;  // regions whose measurements do not vote (tracked objects)
  PlaneMethod method = PlaneMethod::kRigid;
  DepthNoise noise;
};

// Why there is no plane.
enum class PlaneMiss { kNone, kFewReadings, kNoStart, kStartNotFlat, kSmall };

struct FoundPlane {
  InversePlane plane;
  double noise_scale = 1;  // the measured noise over the law's
  double share = 0;        // of the measurements that lie on the plane
  PlaneMiss miss = PlaneMiss::kNone;
};

// Starts from a patch at the start pixel, or from the best of many in the whole image. Takes the rear one of
// close parallel planes (not the top of a box). A miss when no plane holds a tenth of the measurements.
FoundPlane search_plane(const frame::DepthFrame& frame, const Camera& camera, const PlaneOptions& options);

// search_plane() without the reason of a miss. The normal points to the camera.
std::optional<frame::Plane> find_plane(const frame::DepthFrame& frame, const Camera& camera,
                                       const PlaneOptions& options);

// Half the thickness of a measured plane at a depth: noise of a depth sensor grows with the depth squared.
inline double plane_tolerance_m(double tolerance_m, double depth_m) {
  return tolerance_m * std::max(1.0, depth_m * depth_m);
}

// tolerance_m: at 1 m.
inline bool on_plane(const frame::Plane& plane, Vec3d p_cam, double tolerance_m) {
  return std::abs(dot(plane.normal_cam, p_cam) + plane.offset_m) < plane_tolerance_m(tolerance_m, p_cam.z);
}

// The plane that holds most of the points, if it holds `min_share` of them and is `extent_m` wide: the best
// of `seeds` triples of distant points, refitted. Tolerance at 1 m.
std::optional<frame::Plane> plane_among(const std::vector<Vec3d>& points, double tolerance_m, int seeds,
                                        double min_share, double extent_m);

// The plane from frame to frame: followed while it holds, otherwise searched for again now and then.
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
