// SPDX-License-Identifier: MIT
// Bare points against a solid, many at a time: the residual is phi at the point, in float; sums are in
// double. Compiled once per instruction set (reading_loops.h); all of them compute the same bits.
#pragma once

#include "base/isa.h"
#include "energies/penalty.h"
#include "energies/term.h"
#include "primitives/solids.h"

namespace sdftrack::primitives {

// What the normal equations are made of.
enum class Weighing {
  kSolve,   // the slope, and the curvature of the quadratic that touches the cost
  kSecond,  // the second derivative
  kSquare,  // the squared slope
};

struct ReadingTerm {
  const float *x_m, *y_m, *z_m;  // from `pose`'s origin on
  int count;
  Vec3f R[3], t_m;  // T_obj_points: rows, translation
  float size_m[sdf::kMaxSizes];
  float per_s, outlier_floor;
};

struct ReadingSums {
  static constexpr int P = 6 + sdf::kMaxSizes;
  double cost = 0;
  double gradient[P] = {}, hessian[P * (P + 1) / 2] = {};  // lower triangle; of fewer unknowns its first part
};

struct ReadingOps {
  // One of each per kind.
  void (*linearize[kPrimitiveKinds])(const ReadingTerm&, Weighing, ReadingSums*);
  double (*cost[kPrimitiveKinds])(const ReadingTerm&);
  void (*residuals[kPrimitiveKinds])(const ReadingTerm&, float* phi_m);

  // Defined in readings_*.cpp.
  static const ReadingOps baseline, avx2, avx512;
};

}  // namespace sdftrack::primitives
