// SPDX-License-Identifier: MIT
#include "tracking/quick_fit.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "energies/free_space.h"
#include "energies/term.h"

namespace sdftrack {

namespace {

using Penalty = DepthLogistic<float>;
using ReadingTerm = Term<SingleObject<float>, Penalty>;
using Matrix6d = Eigen::Matrix<double, 6, 6>;
using Vector6d = Eigen::Matrix<double, 6, 1>;

constexpr double kDamping = 1e-2;
// A step is drawn back to where it started as if by springs of this size: what no reading holds stays.
constexpr double kSpring_m = 0.05, kSpring_rad = 0.5;
constexpr double kLongestStep_m = 0.05, kLongestStep_rad = 0.6;

float free_scale(const QuickStage& stage) { return 0.5f * stage.scale_m; }

void add_readings(const QuickData& data, const QuickStage& stage, const Rigidf& T_obj_cam,
                  Sums<float, 6>* sums) {
  const SingleObject<float> field{data.sdf, T_obj_cam};
  const Penalty penalty{stage.scale_m, stage.outlier_floor};
  FieldRow<float, 6> row;
  for (const Vec3f& p_cam : *data.readings_cam) {
    field.row(p_cam, &row);
    ReadingTerm::add_row(row, penalty(row.phi_m, 1.0f), 1.0f, sums);
  }
}

// The outline's points together weigh as much as the readings.
float outline_weight(const QuickData& data) {
  return static_cast<float>(data.readings_cam->size()) * static_cast<float>(data.outline_stride) /
         static_cast<float>(std::max<std::size_t>(1, data.outline_obj->size()));
}

void add_free_space(const QuickData& data, const QuickStage& stage, const Rigidf& T_obj_cam,
                    Sums<float, 6>* sums) {
  const Rigidf T_cam_obj = inverse(T_obj_cam);
  const Penalty penalty{free_scale(stage), 0.0f};
  const float weight = outline_weight(data);
  FieldRow<float, 6> row;
  Vec3f dr_cam;
  for (std::size_t i = 0; i < data.outline_obj->size(); i += static_cast<std::size_t>(data.outline_stride)) {
    const Vec3f p_obj = (*data.outline_obj)[i];
    if (!free_space_residual(*data.free_space, data.K, static_cast<float>(data.free_space->step),
                             T_cam_obj * p_obj, &row.phi_m, &dr_cam))
      continue;
    const Vec3f g = T_obj_cam.R * dr_cam, m = cross(p_obj, g);
    const float J[6] = {-g.x, -g.y, -g.z, -m.x, -m.y, -m.z};
    std::copy(J, J + 6, row.J);
    Curve<float> curve = penalty(row.phi_m, 1.0f);
    curve = {weight * curve.cost, weight * curve.slope, weight * curve.curvature};
    ReadingTerm::add_row(row, curve, 1.0f, sums);
  }
}

Vector6d solve(const Sums<float, 6>& sums) {
  Matrix6d H;
  Vector6d g;
  for (int a = 0, k = 0; a < 6; ++a) {
    g(a) = static_cast<double>(sums.gradient[a]);
    for (int b = 0; b <= a; ++b) H(a, b) = H(b, a) = static_cast<double>(sums.hessian[k++]);
  }
  for (int a = 0; a < 6; ++a) {
    const double spring = a < 3 ? kSpring_m : kSpring_rad;
    H(a, a) += kDamping * H(a, a) + 1 / (spring * spring);
  }
  return H.ldlt().solve(-g);
}

Vec3d bounded(const Vec3d& step, double longest) {
  const double length = norm(step);
  return length > longest ? (longest / length) * step : step;
}

}  // namespace

void quick_fit(const QuickData& data, const QuickStage& stage, Rigidf* T_obj_cam) {
  for (int k = 0; k < stage.steps; ++k) {
    Sums<float, 6> sums;
    add_readings(data, stage, *T_obj_cam, &sums);
    if (!data.free_space->empty()) add_free_space(data, stage, *T_obj_cam, &sums);
    const Vector6d d = solve(sums);
    if (!d.allFinite()) return;
    const Vec3d v = bounded({d(0), d(1), d(2)}, kLongestStep_m),
                w = bounded({d(3), d(4), d(5)}, kLongestStep_rad);
    *T_obj_cam = increment(v.cast<float>(), w.cast<float>()) * *T_obj_cam;
  }
}

float quick_cost(const QuickData& data, const QuickStage& stage, const Rigidf& T_obj_cam) {
  const Penalty penalty{stage.scale_m, stage.outlier_floor};
  float cost = 0, phi;
  Vec3f g;
  for (const Vec3f& p_cam : *data.readings_cam) {
    sample(data.sdf, T_obj_cam * p_cam, &phi, &g);
    cost += penalty(phi, 1.0f).cost;
  }
  cost /= static_cast<float>(std::max<std::size_t>(1, data.readings_cam->size()));
  if (data.free_space->empty()) return cost;
  const Rigidf T_cam_obj = inverse(T_obj_cam);
  const Penalty free_penalty{free_scale(stage), 0.0f};
  float outside = 0;
  for (std::size_t i = 0; i < data.outline_obj->size(); i += static_cast<std::size_t>(data.outline_stride))
    if (free_space_residual(*data.free_space, data.K, static_cast<float>(data.free_space->step),
                            T_cam_obj * (*data.outline_obj)[i], &phi, &g))
      outside += free_penalty(phi, 1.0f).cost;
  return cost + outside * static_cast<float>(data.outline_stride) /
                    static_cast<float>(std::max<std::size_t>(1, data.outline_obj->size()));
}

}  // namespace sdftrack
