// SPDX-License-Identifier: MIT
#include "primitives/residuals.h"

#include "primitives/along_ray.h"
#include "primitives/solids.h"

namespace sdftrack::primitives {

void point_residual(const PrimitiveField& field, Vec3d p_cam, SolidResidual* out) {
  PrimitiveField::Row row;
  field.row(p_cam, &row);
  out->m = row.phi_m;
  std::copy(row.J, row.J + PrimitiveField::P, out->J);
}

void ray_residual(const PrimitiveField& field, Vec3d p_cam, SolidResidual* out) {
  if (field.scaling == Scaling::kPrinted) {
    point_residual(field, p_cam, out);
    return;
  }
  const bool in_closed_form = visit_solid(field.kind, [&](auto solid) {
    if constexpr (requires { solid.ray_residual(field, p_cam, -kGrazing, out); }) {
      if (!solid.ray_residual(field, p_cam, -kGrazing, out)) point_residual(field, p_cam, out);
      return true;
    } else {
      return false;
    }
  });
  if (in_closed_form) return;
  const Vec3d way = field.T_obj_cam.R * ((1 / p_cam.z) * p_cam);
  const Vec3d from = field.T_obj_cam * p_cam;
  visit_solid(field.kind, [&](auto solid) {
    const auto met = meet_solid<decltype(solid)>(from, way, field.size_m);
    field.derivative(met.at.p, met.at.s, out->J);
    out->m = met.m;
    for (double& j : out->J) j *= met.factor;
  });
}

void clearance(const PrimitiveField& field, const OutlineRay& ray, SolidResidual* out) {
  const bool in_closed_form = visit_solid(field.kind, [&](auto solid) {
    constexpr bool kOwnTerm = requires { solid.clearance(field, ray, out); };
    if constexpr (kOwnTerm) solid.clearance(field, ray, out);
    return kOwnTerm;
  });
  if (in_closed_form) return;
  const Vec3d from = field.T_obj_cam.t, way = field.T_obj_cam.R * ray.ray;
  visit_solid(field.kind, [&](auto solid) {
    const auto least = least_along_solid<decltype(solid)>(from, way, ray.near_m, ray.far_m, field.size_m);
    double low[PrimitiveField::P], high[PrimitiveField::P];
    field.derivative(least.low.p, least.low.s, low);
    field.derivative(least.high.p, least.high.s, high);
    out->m = least.m;
    for (int j = 0; j < PrimitiveField::P; ++j)
      out->J[j] = least.share * low[j] + (1 - least.share) * high[j];
  });
}

}  // namespace sdftrack::primitives
