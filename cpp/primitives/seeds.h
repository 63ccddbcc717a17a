// SPDX-License-Identifier: MIT
// First guesses of where a solid is and how large, from points and the normals at some of them.
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
  Vec3d p, n;  // n towards the camera where points are along rays, else away from the points' mean
};

// What every kind's guesses start from; made once for all kinds.
struct SeedCloud {
  std::vector<Vec3d> points;  // spread over all
  std::vector<Oriented> normals;
  std::vector<Vec3d> held;  // those with neighbours: what extents are taken from, for outliers have none
  Vec3d mean;
  double diameter_m;
  const PrimitiveView* view;
  bool sparse = false;  // too few points for normals: directions are tried in place of being derived
};
SeedCloud seed_cloud(const PrimitiveView& view);

// Guesses of one kind, best ones not first. The same `seed`, the same guesses.
std::vector<PrimitiveGuess> guesses(PrimitiveKind kind, const SeedCloud& cloud, unsigned seed);

// Of the files seeds_*.cpp: what the guesses of several kinds are made of.
void guess_boxes(const SeedCloud& cloud, unsigned seed, std::vector<PrimitiveGuess>* out);
void guess_round_of_few(PrimitiveKind kind, const SeedCloud& cloud, std::vector<PrimitiveGuess>* out);
void guess_boxes_of_few(const SeedCloud& cloud, unsigned seed, std::vector<PrimitiveGuess>* out);

// The box with these axes around the points; thicker than they are where one face alone is seen.
PrimitiveGuess box_around(const SeedCloud& cloud, Vec3d x, Vec3d y, Vec3d z);
// The least and greatest of p . direction, without the outermost 1 %.
struct Span {
  double low, high;
};
Span span_along(const std::vector<Vec3d>& points, Vec3d direction);
// Two directions across a unit vector.
void across(Vec3d axis, Vec3d* u, Vec3d* v);
// T_obj_cam of a frame with these axes (camera frame) about a point.
Rigidd frame_at(Vec3d x, Vec3d y, Vec3d z, Vec3d origin);
// The point nearest to all normals' lines: the centre of a ball. False where they are all parallel.
bool meeting_point(const std::vector<Oriented>& normals, Vec3d* centre);

// Numbers 0 .. n - 1, the same on every machine.
class Picker {
 public:
  explicit Picker(unsigned seed) : state_(seed * 2654435761u + 12345u) {}
  std::size_t operator()(std::size_t n) {
    state_ = state_ * 6364136223846793005ull + 1442695040888963407ull;
    return static_cast<std::size_t>((state_ >> 33) % n);
  }

 private:
  unsigned long long state_;
};

}  // namespace sdftrack::primitives
