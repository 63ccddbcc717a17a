// SPDX-License-Identifier: MIT
// Loops over a shape's points and a search's measurements, one per instruction set (energies/term_ops.h).
#pragma once

#include "base/isa.h"
#include "frame/quick_terms.h"
#include "frame/select_terms.h"
#include "frame/sight_terms.h"

namespace sdftrack::frame {

// The terms that are summed at one pose. A list without points is left out.
struct QuickTerms {
  ReadingTerm<float> readings, solids;
  SurfaceTerm<float> surface;
  OutlineTerm<float> outline;

  HD void move_to(const Rigidf& T_obj_cam) {
    const Rigidf T_cam_obj = inverse(T_obj_cam);
    readings.field.T_obj_cam = solids.field.T_obj_cam = outline.T_obj_cam = T_obj_cam;
    surface.T_cam_obj = outline.T_cam_obj = T_cam_obj;
  }
};

struct QuickCost {
  double readings = 0, surface = 0, outline = 0;
  double surface_points = 0;  // surface points with a measurement
};

constexpr int kPointsAtOnce = 128;

// The sights of the points that face the camera.
struct Sights {
  int count;
  alignas(64) float facing[kPointsAtOnce], x_m[kPointsAtOnce], y_m[kPointsAtOnce], z_m[kPointsAtOnce];
};

struct Bearings {
  int count;
  alignas(64) float turn[kPointsAtOnce], radius_px[kPointsAtOnce], depth_m[kPointsAtOnce];
};

struct PointOps {
  energies::Sums<double, 6> (*linearize)(const QuickTerms&);  // without the cost
  QuickCost (*cost)(const QuickTerms&);
  int (*explained)(const ExplainedTerm<float>&);  // number of measurements
  // For up to kPointsAtOnce points from `first` on.
  void (*sights)(const SightTerm<float>&, int first, Sights*);
  void (*bearings)(const BearingTerm<float>&, int first, Bearings*);

  // The slope of the cost times the scale, for `count` rays that meet the model.
  void (*pulls)(const PullTerm<float>&, int count, float* pull);
  // Writes the candidates of pixels [x0, x1) of row y to `at` (room for kLanes more); returns their number.
  int (*candidates)(const SelectTerm<float>&, int y, int x0, int x1, int* at);

  // Defined in points_*.cpp.
  static const PointOps baseline, avx2, avx512;
};

inline const PointOps& point_ops_for(Isa isa) { return for_isa<PointOps>(isa); }

}  // namespace sdftrack::frame
