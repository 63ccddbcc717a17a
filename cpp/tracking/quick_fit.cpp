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

// Of readings that must only not be inside, noise puts every other one there.
constexpr float kSolidMargin = 1.5f;  // over the scale of the last stages, which must not be biased
float solid_margin(const QuickStage& stage) {
  return stage.inside_floor < stage.outside_floor ? 0.0f : kSolidMargin * stage.scale_m;
}

constexpr float kHiddenFloor = 0.3f, kSeenPastFloor = 0.02f;
constexpr double kDamping = 1e-2;
// A step is drawn back to where it started as if by springs of this size: what no reading holds stays.
constexpr double kSpring_m = 0.05, kSpring_rad = 0.5;
constexpr double kLongestStep_m = 0.05, kLongestStep_rad = 0.6;

float free_scale(const QuickStage& stage) { return 0.5f * stage.scale_m; }

struct SidedPenalty {
  Penalty outside, inside;
  SidedPenalty(float scale_m, float outside_floor, float inside_floor)
      : outside{scale_m, outside_floor}, inside{scale_m, inside_floor} {}
  Curve<float> operator()(float phi_m) const {
    return phi_m < 0 ? inside(phi_m, 1.0f) : outside(phi_m, 1.0f);
  }
};

SidedPenalty reading_penalty(const QuickStage& stage) {
  return {stage.scale_m, stage.outside_floor, stage.inside_floor};
}

// What stands in front of the place where a surface point should be seen has a good excuse.
SidedPenalty surface_penalty(const QuickStage& stage) {
  return {stage.scale_m, kHiddenFloor, kSeenPastFloor};
}

void add_readings(const QuickData& data, const QuickStage& stage, const Rigidf& T_obj_cam,
                  Sums<float, 6>* sums) {
  const SingleObject<float> field{data.sdf, T_obj_cam};
  const SidedPenalty penalty = reading_penalty(stage);
  FieldRow<float, 6> row;
  for (const Vec3f& p_cam : *data.readings_cam) {
    field.row(p_cam, &row);
    sums->add(ReadingTerm::contribution(row, penalty(row.phi_m), 1.0f));
  }
  for (const Vec3f& p_cam : *data.solids_cam) {
    field.row(p_cam, &row);
    row.phi_m += solid_margin(stage);
    if (row.phi_m < 0) sums->add(ReadingTerm::contribution(row, penalty(row.phi_m), 1.0f));
  }
}

constexpr float kFacing = 0.2f;  // cosine of the incidence below which a surface point is not asked

// phi of the reading that the camera has where it should see a surface point, were the surface flat there:
// what readings of other things cannot spoil, for they are not asked. False where there is none.
bool surface_residual(const QuickData& data, const Rigidf& T_cam_obj, std::size_t i, float* phi_m) {
  const Vec3f p = T_cam_obj * data.shape->search_points[i];
  if (!(p.z > 1e-3f)) return false;
  const Vec3f n_cam = T_cam_obj.R * data.shape->search_normals[i];
  if (dot(n_cam, p) > -kFacing * p.z) return false;
  const SearchScene& scene = *data.scene;
  const Vec2f u = project(data.K, p);
  const float inv = 1.0f / static_cast<float>(scene.step);
  const float x = (u.x - static_cast<float>(scene.x0)) * inv + 0.5f,
              y = (u.y - static_cast<float>(scene.y0)) * inv + 0.5f;
  if (!(x > 0 && y > 0 && x < static_cast<float>(scene.width) && y < static_cast<float>(scene.height)))
    return false;
  const int i_node = static_cast<int>(x), j_node = static_cast<int>(y);
  const float z = scene.depth_m[scene.at(i_node, j_node)];
  const Vec2f node = scene.pixel(i_node, j_node);
  *phi_m = dot(n_cam, z * ray(data.K, node.x, node.y) - p);
  return z > 0;
}

void add_surface(const QuickData& data, const QuickStage& stage, const Rigidf& T_obj_cam,
                 Sums<float, 6>* sums) {
  if (data.surface_stride == 0) return;
  const Rigidf T_cam_obj = inverse(T_obj_cam);
  const SidedPenalty penalty = surface_penalty(stage);
  FieldRow<float, 6> row;
  for (std::size_t i = 0; i < data.shape->search_points.size();
       i += static_cast<std::size_t>(data.surface_stride)) {
    if (!surface_residual(data, T_cam_obj, i, &row.phi_m)) continue;
    const Vec3f p = data.shape->search_points[i], n = data.shape->search_normals[i], m = cross(p, n);
    const float J[6] = {n.x, n.y, n.z, m.x, m.y, m.z};
    std::copy(J, J + 6, row.J);
    sums->add(ReadingTerm::contribution(row, penalty(row.phi_m), 1.0f));
  }
}

// The outline's points together weigh as much as the readings and the surface points.
float outline_weight(const QuickData& data) {
  std::size_t others = data.readings_cam->size();
  if (data.surface_stride > 0)
    others += data.shape->search_points.size() /
              static_cast<std::size_t>(2 * data.surface_stride);  // half face the camera
  return static_cast<float>(others) * static_cast<float>(data.outline_stride) /
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
    sums->add(ReadingTerm::contribution(row, curve, 1.0f));
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
    add_surface(data, stage, *T_obj_cam, &sums);
    if (!data.free_space->empty()) add_free_space(data, stage, *T_obj_cam, &sums);
    const Vector6d d = solve(sums);
    if (!d.allFinite()) return;
    const Vec3d v = bounded({d(0), d(1), d(2)}, kLongestStep_m),
                w = bounded({d(3), d(4), d(5)}, kLongestStep_rad);
    *T_obj_cam = increment(v.cast<float>(), w.cast<float>()) * *T_obj_cam;
  }
}

float quick_cost(const QuickData& data, const QuickStage& stage, const Rigidf& T_obj_cam) {
  const SidedPenalty penalty = reading_penalty(stage);
  float cost = 0, phi;
  Vec3f g;
  for (const Vec3f& p_cam : *data.readings_cam) {
    sample(data.sdf, T_obj_cam * p_cam, &phi, &g);
    cost += penalty(phi).cost;
  }
  for (const Vec3f& p_cam : *data.solids_cam) {
    sample(data.sdf, T_obj_cam * p_cam, &phi, &g);
    phi += solid_margin(stage);
    if (phi < 0) cost += penalty(phi).cost;
  }
  cost /= static_cast<float>(
      std::max<std::size_t>(1, std::max(data.readings_cam->size(), data.solids_cam->size())));
  const Rigidf T_cam_obj = inverse(T_obj_cam);
  if (data.surface_stride > 0) {
    const SidedPenalty surface = surface_penalty(stage);
    float total = 0, count = 1;
    for (std::size_t i = 0; i < data.shape->search_points.size();
         i += static_cast<std::size_t>(data.surface_stride))
      if (surface_residual(data, T_cam_obj, i, &phi)) total += surface(phi).cost, ++count;
    cost += total / count;
  }
  if (data.free_space->empty()) return cost;
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
