// SPDX-License-Identifier: MIT
// Residuals of points and outline pixels from a solid, many at a time: in float, with sums in double.
// Compiled once per instruction set (reading_loops.h); all of them compute the same bits.
#pragma once

#include "base/isa.h"
#include "energies/penalty.h"
#include "energies/term.h"
#include "primitives/solids.h"

namespace sdftrack::primitives {

// Which second-order term the normal equations sum.
enum class Weighing {
  kSolve,   // the curvature of the majorising quadratic
  kSecond,  // the second derivative
  kSquare,  // the squared slope
};

struct FloatSolid {
  Vec3f R[3], t_m;               // T_obj_points: rows, translation
  float size_m[sdf::kMaxSizes];  // exponents: without unit
};

// Bare points with the residual phi; with `ray_x`, points on rays with a residual along the ray.
struct ReadingTerm {
  const float *x_m, *y_m, *z_m;  // from the origin that t_m belongs to
  const float *ray_x, *ray_y;
  const float* per_noise;  // nullptr: all equal
  int count;
  FloatSolid solid;
  float per_s, outlier_floor;
};

struct OutlineTerm {
  const float *ray_x, *ray_y, *near_m, *far_m, *pixel_m, *slack_m, *side, *lost;  // view.h, FloatRays
  int count;
  FloatSolid solid;  // t_m: from the camera
  float scale_px, floor;
  float lost_floor;  // for pixels without a measurement
  bool lost_counts;
};

struct ReadingSums {
  static constexpr int P = 6 + sdf::kMaxSizes;
  double cost = 0;
  double gradient[P] = {}, hessian[P * (P + 1) / 2] = {};  // lower triangle; for fewer unknowns, its start
};

struct ReadingOps {
  // One of each per kind.
  void (*linearize[kPrimitiveKinds])(const ReadingTerm&, Weighing, ReadingSums*);
  double (*cost[kPrimitiveKinds])(const ReadingTerm&);
  void (*residuals[kPrimitiveKinds])(const ReadingTerm&, float* m);
  void (*linearize_outline[kPrimitiveKinds])(const OutlineTerm&, Weighing, ReadingSums*);
  double (*outline_cost[kPrimitiveKinds])(const OutlineTerm&);
  void (*clearances[kPrimitiveKinds])(const OutlineTerm&, float* m);

  // Defined in readings_*.cpp. Packs of 16 lanes are no faster here.
  static const ReadingOps baseline, avx2;
};

}  // namespace sdftrack::primitives
