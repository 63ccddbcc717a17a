// SPDX-License-Identifier: MIT
#include "tracking/fit/contour_library.h"

#include <algorithm>
#include <cmath>

#include "base/to_int.h"

namespace sdftrack::tracking {

namespace {

constexpr int kCells = 45;  // along each side of a cube about the object: two degrees
constexpr double kDistanceRatio = 1.15;
constexpr std::size_t kMaxEntries = 128;

int cell_at(double x) { return std::clamp(to_int((x + 1) / 2 * kCells), 0, kCells - 1); }
double middle_of(int cell) { return (cell + 0.5) / kCells * 2 - 1; }

// The direction's cell on the cube, and the centre of the cell.
int direction_cell(Vec3d d, Vec3d* middle) {
  const double x = std::abs(d.x), y = std::abs(d.y), z = std::abs(d.z);
  const int axis = x >= y && x >= z ? 0 : y >= z ? 1 : 2;
  const double main = axis == 0 ? d.x : axis == 1 ? d.y : d.z;
  const double a = (axis == 0 ? d.y : d.x) / std::abs(main), b = (axis == 2 ? d.y : d.z) / std::abs(main);
  const int i = cell_at(a), j = cell_at(b);
  const double s = main > 0 ? 1 : -1, u = middle_of(i), v = middle_of(j);
  *middle = axis == 0 ? Vec3d{s, u, v} : axis == 1 ? Vec3d{u, s, v} : Vec3d{u, v, s};
  return ((2 * axis + (main > 0 ? 1 : 0)) * kCells + i) * kCells + j;
}

// A camera at `eye` that looks at the origin; T_cam_obj.
Rigidd looking_from(Vec3d eye) {
  const Vec3d z = (-1 / norm(eye)) * eye;
  const Vec3d up = std::abs(z.z) < 0.8 ? Vec3d{0, 0, 1} : Vec3d{1, 0, 0};
  Vec3d x = cross(up, z);
  x = (1 / norm(x)) * x;
  const Mat3d R{x, cross(z, x), z};
  return {R, -(R * eye)};
}

}  // namespace

const std::vector<ContourPoint>& ContourLibrary::seen_from(Vec3d eye_obj, const frame::Shape& shape,
                                                           double focal_px, int requested,
                                                           double thickness_px) {
  Vec3d direction;
  const int cell = direction_cell(eye_obj, &direction);
  const int distance = to_int(std::round(std::log(norm(eye_obj)) / std::log(kDistanceRatio)));
  const bool keep = !shape.seen.amount;  // a partially known shape still grows
  if (entries_.empty()) {                // only once, so that no later frame allocates
    entries_.resize(kMaxEntries);
    for (Entry& e : entries_) e.points.reserve(2 * requested);
  }
  for (const Entry& e : entries_)
    if (keep && e.shape == shape.id && e.cell == cell && e.distance == distance && e.requested == requested &&
        e.focal_px == focal_px && e.thickness_px == thickness_px)
      return e.points;
  Entry& made = entries_[next_];
  next_ = (next_ + 1) % kMaxEntries;
  made.shape = keep ? shape.id : 0, made.cell = cell, made.distance = distance, made.requested = requested;
  made.focal_px = focal_px, made.thickness_px = thickness_px;
  const Vec3d eye = (std::pow(kDistanceRatio, distance) / norm(direction)) * direction;
  find_contour({focal_px, focal_px, 0, 0}, shape, looking_from(eye), requested, thickness_px, &scratch_,
               &made.points);
  return made.points;
}

}  // namespace sdftrack::tracking
