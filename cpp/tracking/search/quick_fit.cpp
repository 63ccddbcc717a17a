// SPDX-License-Identifier: MIT
#include "tracking/search/quick_fit.h"

#include <algorithm>
#include <cmath>

#include "frame/point_ops.h"
#include "optim/dense.h"

namespace sdftrack::tracking {

namespace {

using Penalty = energies::DepthLogistic<float>;
using Matrix6d = Eigen::Matrix<double, 6, 6>;
using Vector6d = Eigen::Matrix<double, 6, 1>;

// For measurements that must only not be inside: noise puts every other one inside.
constexpr float kSolidMargin = 1.5f;  // over the scale of the last stages, which must not be biased
float solid_margin(const QuickStage& stage) {
  return stage.inside_floor < stage.outside_floor ? 0.0f : kSolidMargin * stage.scale_m;
}

constexpr float kHiddenFloor = 0.3f, kSeenPastFloor = 0.02f;
constexpr double kDamping = 1e-2;
// A step is pulled back to its start as if by springs of this size: a direction held by no measurement stays.
constexpr double kSpring_m = 0.05, kSpring_rad = 0.5;
constexpr double kLongestStep_m = 0.05, kLongestStep_rad = 0.6;

frame::PointsView view_of(const std::vector<Vec3f>& points, int stride = 1) {
  return {points.data(), static_cast<int>(points.size()), stride};
}

// The outline's points together weigh as much as the measurements and the surface points.
float outline_weight(const QuickData& data) {
  std::size_t others = data.readings_cam->size();
  if (data.surface_stride > 0)
    others += data.shape->search_points.size() /
              static_cast<std::size_t>(2 * data.surface_stride);  // half face the camera
  return static_cast<float>(others) * static_cast<float>(data.outline_stride) /
         static_cast<float>(std::max<std::size_t>(1, data.outline_obj->size()));
}

Vector6d solve(const energies::Sums<double, 6>& sums) {
  Matrix6d H;
  Vector6d g;
  for (int a = 0, k = 0; a < 6; ++a) {
    g(a) = sums.gradient[a];
    for (int b = 0; b <= a; ++b) H(a, b) = H(b, a) = sums.hessian[k++];
  }
  for (int a = 0; a < 6; ++a) {
    const double spring = a < 3 ? kSpring_m : kSpring_rad;
    H(a, a) += kDamping * H(a, a) + 1 / (spring * spring);
  }
  return optim::solve_symmetric<6, 1>(H, -g);
}

Vec3d bounded(const Vec3d& step, double longest) {
  const double length = norm(step);
  return length > longest ? (longest / length) * step : step;
}

}  // namespace

frame::QuickTerms quick_terms(const QuickData& data, const QuickStage& stage) {
  const energies::SingleObject<float> field{data.sdf, {}};
  const Penalty reading{stage.scale_m, stage.outside_floor, energies::Curvature::kIrls, stage.inside_floor};
  // An occluder in front of the expected place of a surface point hardly counts against the pose.
  const Penalty surface{stage.scale_m, kHiddenFloor, energies::Curvature::kIrls, kSeenPastFloor};
  frame::QuickTerms terms{{field, reading, view_of(*data.readings_cam), false, 0},
                          {field, reading, view_of(*data.solids_cam), true, solid_margin(stage)},
                          {{}, data.K, surface, {}, {}, {}},
                          {{}, {}, data.K, {0.5f * stage.scale_m, 0.0f}, {}, {}, outline_weight(data), 0}};
  if (data.surface_stride > 0) {
    const SearchScene& s = *data.scene;
    terms.surface.nodes = {s.depth_m.data(), s.x0, s.y0, s.step, s.width, s.height};
    terms.surface.points_obj = view_of(data.shape->search_points, data.surface_stride);
    terms.surface.normals_obj = view_of(data.shape->search_normals, data.surface_stride);
  }
  if (!data.free_space->empty()) {
    terms.outline.grid = data.free_space->view();
    terms.outline.dead_px = static_cast<float>(data.free_space->step);
    terms.outline.points_obj = view_of(*data.outline_obj, data.outline_stride);
  }
  return terms;
}

bool quick_step(const energies::Sums<double, 6>& sums, Rigidf* T_obj_cam) {
  const Vector6d d = solve(sums);
  if (!d.allFinite()) return false;
  const Vec3d v = bounded({d(0), d(1), d(2)}, kLongestStep_m),
              w = bounded({d(3), d(4), d(5)}, kLongestStep_rad);
  *T_obj_cam = increment(v.cast<float>(), w.cast<float>()) * *T_obj_cam;
  return true;
}

float quick_total(const QuickData& data, const frame::QuickCost& cost) {
  const auto mean = [](double sum, double count) { return sum / std::max(1.0, count); };
  const auto readings = static_cast<double>(std::max(data.readings_cam->size(), data.solids_cam->size()));
  double total = mean(cost.readings, readings);
  if (data.surface_stride > 0) total += cost.surface / (1 + cost.surface_points);
  if (!data.free_space->empty())
    total += mean(cost.outline, static_cast<double>(data.outline_obj->size()) / data.outline_stride);
  return static_cast<float>(total);
}

void quick_fit(const QuickData& data, const QuickStage& stage, Rigidf* T_obj_cam) {
  const frame::PointOps& ops = frame::point_ops_for(used_isa());
  frame::QuickTerms terms = quick_terms(data, stage);
  for (int k = 0; k < stage.steps; ++k) {
    terms.move_to(*T_obj_cam);
    if (!quick_step(ops.linearize(terms), T_obj_cam)) return;
  }
}

float quick_cost(const QuickData& data, const QuickStage& stage, const Rigidf& T_obj_cam) {
  frame::QuickTerms terms = quick_terms(data, stage);
  terms.outline.weight = 1;
  terms.move_to(T_obj_cam);
  return quick_total(data, frame::point_ops_for(used_isa()).cost(terms));
}

}  // namespace sdftrack::tracking
