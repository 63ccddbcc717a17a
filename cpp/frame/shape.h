// SPDX-License-Identifier: MIT
// A shape made ready for tracking: its field about the centre of its box, and points on its surface.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "energies/color_field.h"
#include "frame/seen.h"
#include "frame/slips.h"
#include "sdf/surface_samples.h"

namespace sdftrack::frame {

// The tracker's own object frame has its origin at the centre of the object's box, so that translation and
// rotation are hardly coupled: p_centred = p_obj - centre_obj.
struct Shape {
  std::uint64_t id = 0;                              // unique to each shape of make_shape
  SdfView sdf;                                       // in the centred frame; the values belong to the caller
  std::shared_ptr<const std::vector<float>> values;  // unless it was enlarged: then it has values of its own
  SeenView seen;                                     // for `sdf`
  energies::ColorView colors;                        // for `sdf`
  Vec3d centre_obj;                                  // of the box of {phi <= 0}, in the caller's object frame
  Vec3d half_box_m;                                  // of that box
  double diameter_m;                                 // the box's diagonal
  Vec3f middle{};                                    // the point deepest inside, centred frame
  float depth_m = 0;                                 // the depth of `middle` inside
  std::vector<Vec3f> points, normals;                // on the surface, uniform by area, centred frame
  std::array<std::vector<Vec3f>, 2> smooth_normals;  // of a partly known shape (slips.h)
  Moments moments;                                   // of the points
  std::vector<std::array<double, 6>> slips;  // rotations that leave it unchanged (slips.h, half a diameter)
  std::vector<Vec3f> outline;                // fewer points, for the free-space term
  std::vector<Vec3f> contact;                // more points, which may come to lie in other objects
  std::vector<Vec3f> search_points, search_normals;  // the same, with fewer points, for a search
  std::vector<float> coarse_phi;  // the field on fewer voxels, which fit the cache, for a search
  SdfView coarse_sdf;             // without its pointer; see coarse()

  SdfView coarse() const {
    SdfView view = coarse_sdf;
    view.phi = coarse_phi.data();
    return view;
  }
};

// ValueError (std::invalid_argument) when the field has no inside.
Shape make_shape(const SdfView& sdf, int point_count, int outline_count);

// A partly known shape, which is made again while more of it is seen.
struct PartialShape {
  SdfView sdf;
  SeenView seen;
  energies::ColorView colors;
  std::vector<sdf::VoxelBox> boxes;  // boxes that hold the surface
  Vec3d centre_obj;                  // the fixed origin of the centred frame, even if the box's centre moves
};
// With points only where the surface has been seen, and without points for contact.
Shape make_shape(const PartialShape& known, int point_count, int outline_count);

}  // namespace sdftrack::frame
