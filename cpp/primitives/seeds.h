// SPDX-License-Identifier: MIT
// Initial guesses of a solid's pose and size, from points and the normals at some of them.
#pragma once

#include <vector>

#include "primitives/solids.h"
#include "primitives/view.h"

namespace sdftrack::primitives {

struct PrimitiveGuess {
  Rigidd T_obj_cam;
  PrimitiveSize size;
};

// A point with the plane through its neighbours.
struct Oriented {
  Vec3d p, n;  // n: towards the camera for points along rays, else away from the points' mean
};

// The input of every kind's guesses; made once for all kinds.
struct SeedCloud {
  std::vector<Vec3d> points;  // spread over all
  std::vector<Oriented> normals;
  std::vector<Vec3d> held;  // points with neighbours, for extents: outliers have none
  Vec3d mean;
  double diameter_m;
  const PrimitiveView* view;
  bool sparse = false;  // too few points for normals: directions are tried instead
};
SeedCloud seed_cloud(const PrimitiveView& view);

// Guesses for one kind, unsorted. The same `seed` gives the same guesses.
std::vector<PrimitiveGuess> guesses(PrimitiveKind kind, const SeedCloud& cloud, unsigned seed);

// Superquadrics of other exponents and with other axes for z, at the pose and in the proportions of one.
void reshape_superquadric(const SeedCloud& cloud, const PrimitiveGuess& g, std::vector<PrimitiveGuess>* out);

// Parts that the guesses of several kinds share, defined in seeds_*.cpp.
void guess_boxes(const SeedCloud& cloud, unsigned seed, std::vector<PrimitiveGuess>* out);
void guess_round_of_few(PrimitiveKind kind, const SeedCloud& cloud, std::vector<PrimitiveGuess>* out);
void guess_boxes_of_few(const SeedCloud& cloud, unsigned seed, std::vector<PrimitiveGuess>* out);

// The box with these axes around the points; given a thickness where only one face is seen.
PrimitiveGuess box_around(const SeedCloud& cloud, Vec3d x, Vec3d y, Vec3d z);
// The least and the greatest p . direction, without the outermost 1 %.
struct Span {
  double low, high;
};
Span span_along(const std::vector<Vec3d>& points, Vec3d direction);
// Two unit vectors perpendicular to a unit vector and to each other.
void across(Vec3d axis, Vec3d* u, Vec3d* v);
// T_obj_cam of a frame with these axes (camera frame) about a point.
Rigidd frame_at(Vec3d x, Vec3d y, Vec3d z, Vec3d origin);
// The point nearest to the lines of all normals: the centre of a ball. False if all are parallel.
bool meeting_point(const std::vector<Oriented>& normals, Vec3d* centre);

// Numbers 0 .. n - 1, the same on every machine.
class Picker {
 public:
  explicit Picker(unsigned seed) : state_(seed * 2654435761u + 12345u) {}
  std::size_t operator()(std::size_t n) {
    state_ = state_ * 6364136223846793005ull + 1442695040888963407ull;
    return std::size_t((state_ >> 33) % n);
  }

 private:
  unsigned long long state_;
};

}  // namespace sdftrack::primitives
