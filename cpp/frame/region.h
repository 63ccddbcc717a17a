// SPDX-License-Identifier: MIT
// The image region where an object may be, and where the sensor sees past it.
#pragma once

#include <functional>
#include <limits>
#include <string_view>

#include "appearance/color_map.h"
#include "base/camera.h"
#include "base/rigid.h"
#include "base/views.h"
#include "energies/distance_transform.h"
#include "frame/select_terms.h"
#include "frame/shape.h"

namespace sdftrack::frame {

struct DepthFrame {
  ImageView<float> depth_m;   // 0 or NaN: no measurement; without data: the frame has no depth image
  const unsigned char* mask;  // 0: not the object; nullptr: all pixels
  const float* rays;          // x, y of every pixel's ray (ray_table), nullptr without distortion
  double time_s = std::numeric_limits<double>::quiet_NaN();
  const appearance::ColorImage* color = nullptr;
  std::string_view error = {};  // without a depth image: why it could not be read
  // depth_m before the holes of a registration were filled; nullptr: the same. What was filled is no
  // measurement of its own: its error is that of its neighbours.
  const float* given_m = nullptr;

  const float* measured_m() const { return given_m ? given_m : depth_m.data; }
};

// The pixel where a pixel's ray would be in the ideal pinhole, without distortion.
struct IdealPixel {
  const DepthFrame& frame;
  Intrinsics<float> K;
  int width;

  Vec2f operator()(int x, int y) const { return ideal_pixel(frame.rays, K, width, x, y); }
};

// The depth measured in the direction of a point in front of the camera; 0: none, or outside the image.
double reading_at(const DepthFrame& frame, const Camera& camera, Vec3d p_cam);

struct Rect {
  int x0, y0, x1, y1;  // half open
  bool empty() const { return x0 >= x1 || y0 >= y1; }

  template <class Archive, class Self>
  static void visit(Archive& archive, Self& self) {
    auto& [left, top, right, bottom] = self;
    archive(left, top, right, bottom);
  }
};

// The smallest rectangle that contains all pixels of a mask; empty if the mask is.
Rect mask_bounds(const unsigned char* mask, int width, int height);

// The image region that the padded box can project to; the whole image when it reaches behind the camera.
Rect projected_box(const Camera& camera, const Shape& shape, const Rigidd& T_cam_obj, double padding_m);

struct DepthRange {
  double near_m, far_m;
};
DepthRange depth_range(const Shape& shape, const Rigidd& T_cam_obj, double padding_m);

// n . p + d = 0, camera frame.
struct Plane {
  Vec3d normal_cam;
  double offset_m;

  template <class Archive, class Self>
  static void visit(Archive& archive, Self& self) {
    auto& [normal, offset] = self;
    archive(normal, offset);
  }
};

// The sd of the sensor's depth noise, noise_m + noise_per_m * Z^2.
struct DepthNoiseLaw {
  double noise_m, noise_per_m;

  double at(double depth_m) const { return noise_m + noise_per_m * depth_m * depth_m; }
};

// The distance to the nearest pixel that might show the object, on about 40 x 40 nodes.
struct FreeSpaceScratch {
  std::vector<unsigned char> free, columns;
  energies::DistanceScratch transform;
};
// `is_background(at, u, depth_m)`, if given, is called for pixels without a measurement, as if they were at
// the object's depth: where it returns true, the pixel counts as free.
using IsBackground = std::function<bool(int at, Vec2f ideal_px, float depth_m)>;
void free_space_grid(const DepthFrame& frame, const Camera& camera, const Shape& shape,
                     const Rigidd& T_cam_obj, double padding_m, const IsBackground* is_background,
                     FreeSpaceScratch* scratch, energies::DistanceGrid* grid);

}  // namespace sdftrack::frame
