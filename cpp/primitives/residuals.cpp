// SPDX-License-Identifier: MIT
#include "primitives/residuals.h"

#include <algorithm>
#include <cmath>

#include "primitives/solids.h"

namespace sdftrack::primitives {

namespace {

constexpr double kGrazing = -0.17;   // cosine of 80 degrees: a reading beyond says little
constexpr double kOnSurface = 2e-5;  // m
constexpr double kStepBack = 0.02;   // m towards the camera, to meet a solid from outside
constexpr int kHitSteps = 5;
constexpr int kCuts = 12;
constexpr double kBracket = 1e-4;  // m

void scaled(const PrimitiveField::Row& row, double factor, SolidResidual* out) {
  for (int j = 0; j < PrimitiveField::P; ++j) out->J[j] = factor * row.J[j];
}

}  // namespace

void point_residual(const PrimitiveField& field, Vec3d p_cam, SolidResidual* out) {
  PrimitiveField::Row row;
  field.row(p_cam, &row);
  out->m = row.phi_m;
  scaled(row, 1, out);
}

void ray_residual(const PrimitiveField& field, Vec3d p_cam, SolidResidual* out) {
  const bool in_closed_form = visit_solid(field.kind, [&](auto solid) {
    if constexpr (requires { solid.ray_residual(field, p_cam, -kGrazing, out); }) {
      if (!solid.ray_residual(field, p_cam, -kGrazing, out)) point_residual(field, p_cam, out);
      return true;
    } else {
      return false;
    }
  });
  if (in_closed_form) return;
  const double z = p_cam.z;
  const Vec3d ray = (1 / z) * p_cam;
  double at = z;
  bool back = false;
  PrimitiveField::Row row;
  for (int step = 0; step < kHitSteps; ++step) {
    field.row(at * ray, &row);
    const double c = dot(row.grad_cam, ray);
    if (std::abs(row.phi_m) < kOnSurface && c < kGrazing) {
      out->m = at - row.phi_m / c - z;
      scaled(row, -1 / c, out);
      return;
    }
    if (c < kGrazing) {
      at -= row.phi_m / c;  // phi is convex: from outside no step goes too far
    } else if (row.phi_m < 0 && !back) {
      at -= kStepBack, back = true;
    } else {
      break;
    }
  }
  point_residual(field, p_cam, out);
}

void clearance(const PrimitiveField& field, const OutlineRay& ray, SolidResidual* out) {
  const bool in_closed_form = visit_solid(field.kind, [&](auto solid) {
    constexpr bool kOwnTerm = requires { solid.clearance(field, ray, out); };
    if constexpr (kOwnTerm) solid.clearance(field, ray, out);
    return kOwnTerm;
  });
  if (in_closed_form) return;
  // phi is convex along a line: the slopes at both ends of a bracket say where its least value lies.
  double a = ray.near_m, b = ray.far_m;
  PrimitiveField::Row low, high;
  field.row(a * ray.ray, &low);
  field.row(b * ray.ray, &high);
  double slope_a = dot(low.grad_cam, ray.ray), slope_b = dot(high.grad_cam, ray.ray);
  if (slope_a >= 0 || slope_b <= 0) {  // least at an end
    const PrimitiveField::Row& end = slope_a >= 0 ? low : high;
    out->m = end.phi_m;
    scaled(end, 1, out);
    return;
  }
  for (int cut = 0; cut < kCuts && b - a > kBracket; ++cut) {
    // Where the two tangents meet, exact for the flat faces of a box; kept off the ends for all others.
    double t = a + (high.phi_m - low.phi_m - slope_b * (b - a)) / (slope_a - slope_b);
    const double edge = 0.5 * kBracket;
    t = cut % 3 == 2 ? 0.5 * (a + b) : std::clamp(t, a + edge, b - edge);
    PrimitiveField::Row middle;
    field.row(t * ray.ray, &middle);
    const double slope = dot(middle.grad_cam, ray.ray);
    if (slope < 0)
      a = t, low = middle, slope_a = slope;
    else
      b = t, high = middle, slope_b = slope;
    // Both tangents give the least value where they meet: no cut will find a lower one than that.
    const double met = a + (high.phi_m - low.phi_m - slope_b * (b - a)) / (slope_a - slope_b);
    const double bound = low.phi_m + slope_a * (met - a);
    if (std::min(low.phi_m, high.phi_m) - bound < 1e-6) break;
  }
  // At an edge phi has a kink; the mixture of both sides that is level along the ray is its derivative.
  const double share = slope_b / (slope_b - slope_a);
  const double met = a + (high.phi_m - low.phi_m - slope_b * (b - a)) / (slope_a - slope_b);
  out->m = low.phi_m + slope_a * (met - a);
  for (int j = 0; j < PrimitiveField::P; ++j) out->J[j] = share * low.J[j] + (1 - share) * high.J[j];
}

}  // namespace sdftrack::primitives
