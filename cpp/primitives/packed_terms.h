// SPDX-License-Identifier: MIT
// The packed points and rays of a view as input of the loops; they must outlive the term. Not in
// reading_ops.h: files that are compiled for one instruction set share no vectors.
#pragma once

#include "primitives/reading_ops.h"
#include "primitives/view.h"

namespace sdftrack::primitives {

// For the first `count` points; bare points if not `along_rays`.
inline ReadingTerm reading_term(const FloatPoints& p, bool along_rays, const float* per_noise,
                                std::size_t count, const FloatSolid& solid, double per_s,
                                double outlier_floor) {
  return {p.x_m.data(),
          p.y_m.data(),
          p.z_m.data(),
          along_rays ? p.ray_x.data() : nullptr,
          along_rays ? p.ray_y.data() : nullptr,
          per_noise,
          int(count),
          solid,
          float(per_s),
          float(outlier_floor)};
}

inline OutlineTerm outline_term(const FloatRays& r, std::size_t count, const FloatSolid& solid,
                                double scale_px, double floor, double lost_floor, bool lost_counts) {
  return {r.ray_x.data(),   r.ray_y.data(), r.near_m.data(),   r.far_m.data(), r.pixel_m.data(),
          r.slack_m.data(), r.side.data(),  r.lost.data(),     int(count),     solid,
          float(scale_px),  float(floor),   float(lost_floor), lost_counts};
}

}  // namespace sdftrack::primitives
