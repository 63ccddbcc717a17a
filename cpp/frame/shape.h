// SPDX-License-Identifier: MIT
// A shape made ready for tracking: its field about the centre of its box, and points on its surface.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "base/to_int.h"
#include "base/views.h"
#include "energies/color_field.h"
#include "frame/slips.h"
#include "sdf/surface_samples.h"

namespace sdftrack::frame {

// Which part of a shape's surface is known: while a shape is reconstructed, only that may be matched.

// How much of the surface was seen near each voxel: a grid like that of the shape's volume.
struct SeenView {
  const std::uint16_t* amount = nullptr;  // nullptr: the whole surface is known
  int stride = 1;
  std::uint16_t least = 1;  // a smaller amount counts as unseen; 0: all is seen

  bool at(std::size_t voxel) const { return !amount || amount[voxel * std::size_t(stride)] >= least; }
  // Whether the surface below p_obj was seen, by the voxel nearest to that surface point.
  bool below(const SdfView& sdf, Vec3f p_obj) const {
    if (!amount || least == 0) return true;
    float phi;
    Vec3f gradient;
    sample(sdf, p_obj, &phi, &gradient);
    const Vec3f q = (1 / sdf.voxel_m) * (p_obj - phi * gradient - sdf.origin_obj);
    const int x = to_int(q.x + 0.5f), y = to_int(q.y + 0.5f), z = to_int(q.z + 0.5f);
    if (!(q.x > 0 && q.y > 0 && q.z > 0) || x >= sdf.nx || y >= sdf.ny || z >= sdf.nz) return false;
    const std::size_t i = (std::size_t(z) * sdf.ny + y) * sdf.nx + x;
    return at(i);
  }
};

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
