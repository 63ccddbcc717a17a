// SPDX-License-Identifier: MIT
// Many rough fits: a frame's energies on a hundred points, and a few Gauss-Newton steps without line search.
#pragma once

#include <vector>

#include "base/camera.h"
#include "base/rigid.h"
#include "base/views.h"
#include "energies/distance_transform.h"
#include "frame/point_ops.h"
#include "tracking/search/search_scene.h"

namespace sdftrack::tracking {

struct QuickData {
  SdfView sdf;
  Intrinsics<float> K;
  const std::vector<Vec3f>* readings_cam;  // back-projected measurements that may be the object's
  const std::vector<Vec3f>* solids_cam;    // measurements of other things: the object is not in front of them
  const std::vector<Vec3f>* outline_obj;   // surface points for the free-space term
  int outline_stride;                      // every n-th of them is used
  const energies::DistanceGrid* free_space;
  const SearchScene* scene;   // for the surface term
  const frame::Shape* shape;  // its points
  int surface_stride;         // every n-th of them is used; 0: no surface term
};

struct QuickStage {
  float scale_m;  // s of the penalties
  // e of a measurement in front of the surface, which may show something else, and of one inside the object.
  // The latter is seen through the surface, so it contradicts the pose whatever it shows. Different values
  // cause a small bias.
  float outside_floor, inside_floor;
  int steps;
};

// The terms to be summed, independent of the pose (QuickTerms::move_to).
frame::QuickTerms quick_terms(const QuickData& data, const QuickStage& stage);
// Takes one step by these sums; returns false, without a step, where they allow none.
bool quick_step(const energies::Sums<double, 6>& sums, Rigidf* T_obj_cam);
// The number that quick_cost returns.
float quick_total(const QuickData& data, const frame::QuickCost& cost);

// Gauss-Newton steps from T_obj_cam; the steps are damped and bounded, not tested.
void quick_fit(const QuickData& data, const QuickStage& stage, Rigidf* T_obj_cam);

// Mean cost of a measurement plus mean cost of an outline point.
float quick_cost(const QuickData& data, const QuickStage& stage, const Rigidf& T_obj_cam);

}  // namespace sdftrack::tracking
