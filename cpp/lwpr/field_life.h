// SPDX-License-Identifier: MIT
// How a field begins, gets another projection and is removed: code shared by the CPU and the CUDA kernel.
#pragma once

#include "lwpr/layout.h"

namespace sdftrack::lwpr {

// Initial values of a new field.
struct FieldStart {
  double lambda, alpha, log_alpha;
};

// A projection starts along an axis: u_r = e_r (u = 0 would give 0 / 0). The record has room for it.
HD void begin_projection(const FieldLayout& at, double* head) {
  const int r = int(head[FieldLayout::kProjections]);
  double* const projection = head + at.record_size(r);
  head[FieldLayout::kProjections] = r + 1;
  head[FieldLayout::kWanted] = 0;
  for (int j = 0; j < at.projection_size(); ++j) projection[j] = 0;
  projection[FieldLayout::kSS] = kSsFloor;
  projection[at.u() + r] = kFirstU;
}

// A field without projections at x, with the metric M.
HD void begin_field(const FieldLayout& at, const FieldStart& start, const double* M, const double* x,
                    double* lane, double* head) {
  for (int row = 0; row < at.block_rows(); ++row) lane[row * kFieldLanes] = 0;
  for (int j = 0; j < at.n; ++j) lane[j * kFieldLanes] = x[j];
  for (int j = 0; j < at.metric_size(); ++j) lane[(at.n + j) * kFieldLanes] = M[j];
  for (int j = 0; j < at.projections(); ++j) head[j] = 0;
  head[FieldLayout::kLambda] = start.lambda;
  for (int j = 0; j < at.metric_size(); ++j) {
    head[at.alpha() + j] = start.alpha;
    if (at.meta) head[at.log_alpha() + j] = start.log_alpha;
  }
}

HD int first_projections(const FieldLayout& at) { return at.n < 2 ? at.n : 2; }

// Of two fields that both cover a sample, the one with the larger error is removed, else the younger one.
HD bool older_goes(const FieldLayout& at, const double* older, const double* younger) {
  const int to = int(older[FieldLayout::kTrusted]), ty = int(younger[FieldLayout::kTrusted]);
  if (!(to > 0 && ty > 0)) return ty > 0;
  return older[at.record_size(to - 1) + FieldLayout::kMSE] * younger[FieldLayout::kW] >
         younger[at.record_size(ty - 1) + FieldLayout::kMSE] * older[FieldLayout::kW];
}

// Moves the field at `from` to `to`, which may be the same place, and leaves `from` empty.
HD void move_field(const FieldLayout& at, double* from_lane, const double* from, std::ptrdiff_t record,
                   double* to_lane, double* to) {
  for (int row = 0; row < at.block_rows(); ++row) to_lane[row * kFieldLanes] = from_lane[row * kFieldLanes];
  for (int j = 0; j < at.n; ++j) from_lane[j * kFieldLanes] = __builtin_nan("");
  for (std::ptrdiff_t j = 0; j < record; ++j) to[j] = from[j];
}

}  // namespace sdftrack::lwpr
