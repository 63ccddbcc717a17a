// SPDX-License-Identifier: MIT
// What the first frame of a recording shows of an unknown object: its pixels, a ball fitted to them, and the
// space that it may occupy (docs/math/reconstruction.md, section 5).
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "reconstruction/first_view.h"
#include "reconstruction/object_mask.h"
#include "sdf/grid.h"
#include "tracking/pose_hint.h"

namespace sdftrack::reconstruction {

struct Ball {
  Vec3d centre_cam{0, 0, 0};
  double radius_m = 0;
  double behind_m = 0;   // its centre, behind the object's front
  double shorter_m = 0;  // the shorter side of the mask
};

// Bounds on the object in the first camera's frame. from_m: for each pixel its least depth: 1 mm in the
// margin around the mask, infinite where it cannot be; within the mask minus the depth of its far side (0:
// unknown). The object is above the planes.
struct ViewBounds {
  std::vector<float> from_m;
  std::vector<PlaneBelow> planes;
};

struct Beginning {
  Rigidd T_cam_obj;
  PixelMask on_object;
  Ball ball;
  double noise_m = 0;                // sd of the depth
  std::optional<ViewBounds> view;    // none: the object may be anywhere
  std::optional<PixelMask> outline;  // the mask, or the box; none where a pose was given

  // The bounds at this pose of the object; nullptr: none. far_side: also where the object's far side may be.
  std::shared_ptr<const FirstView> view_at(const Camera& camera, const Rigidd& T_cam_obj,
                                           bool far_side = true) const;
};

struct BeginningOptions {
  bool planes = true, keep_to_mask = true;
  int mask_margin_px = 3;
  std::optional<double> noise_m;  // none: it is measured within the mask
};

// A known volume, which belongs to the caller: distances (m) by voxel.
struct KnownShape {
  sdf::Grid grid;
  const float* phi;

  SdfView view() const { return grid.view(phi); }
  // The box of the voxel centres inside.
  struct Extent {
    Vec3d low, high;
  };
  Extent extent() const;
};

// The object at a mask, a box, or a pose of `initial`; the latter may be nullptr for the first two. Throws
// std::invalid_argument where there is no object to be seen.
Beginning find_object(const frame::DepthFrame& frame, const tracking::PoseHint& place, const Camera& camera,
                      const KnownShape* initial, const BeginningOptions& options);

// As find_object with a pose, for a shape whose outline is unknown, on planes seen around it.
Beginning find_standing(const frame::DepthFrame& frame, const Rigidd& T_cam_obj, const Camera& camera,
                        const KnownShape& shape, const BeginningOptions& options);

// Planes around the object that are larger than it, and that it is above.
std::vector<PlaneBelow> planes_below(const ImageView<float>& depth_m, const PixelMask& on_object,
                                     const Camera& camera, double size_m);

// Sd (m) of the depth in a mask about straight lines through neighbouring measurements; at least 0.5 mm.
double measured_noise_m(const frame::DepthFrame& frame, const PixelMask& mask);

}  // namespace sdftrack::reconstruction
