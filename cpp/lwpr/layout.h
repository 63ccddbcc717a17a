// SPDX-License-Identifier: MIT
// The memory layout of receptive fields. The numbers that every sample reads (centre, metric, local linear
// function) are in blocks of kFieldLanes fields, number by number, so that a pack of lanes holds one number
// of that many fields. The numbers that change only for a sample inside a field are in the field's record.
#pragma once

#include <cstddef>

#include "base/hd.h"

namespace sdftrack::lwpr {

constexpr int kFieldLanes = 8;

struct FieldLayout {
  int n = 0;              // inputs
  bool diagonal = false;  // whether the metric is diagonal
  bool meta = false;      // whether learning rates are learnt
  int row = 0;            // n, rounded up to a whole number of packs of 4 beyond kMaxUnrolled inputs

  static constexpr int kMaxUnrolled = 3;

  FieldLayout() = default;
  FieldLayout(int n_in, bool is_diagonal, bool with_meta)
      : n(n_in),
        diagonal(is_diagonal),
        meta(with_meta),
        row(n_in <= kMaxUnrolled ? n_in : (n_in + 3) / 4 * 4) {}

  // A block: rows of kFieldLanes numbers. The centre of a lane without a field is NaN.
  HD int metric_size() const { return diagonal ? n : n * (n + 1) / 2; }
  HD int center() const { return 0; }
  HD int metric() const { return n; }
  HD int slope() const { return n + metric_size(); }  // of the field's linear function
  HD int value() const { return slope() + n; }        // value of the function at the centre
  HD int ready() const { return value() + 1; }        // 1: it has seen enough; else 0
  HD int block_rows() const { return ready() + 1; }
  HD int block_size() const { return block_rows() * kFieldLanes; }
  // Entry (i, j), i <= j, of the upper triangular M among the numbers of the metric.
  HD int entry(int i, int j) const { return diagonal ? i : i * n - i * (i - 1) / 2 + (j - i); }

  // A record: the head, the mean of the inputs, learning rates, then projection by projection.
  enum Head {
    kW,
    kBeta0,
    kLambda,
    kCount,
    kProjections,
    kTrusted,
    kLooW,
    kLooE,
    kLeverage,
    kWanted,
    kHeadSize = 12
  };
  HD int mean() const { return kHeadSize; }
  HD int alpha() const { return mean() + row; }
  HD int log_alpha() const { return alpha() + metric_size(); }   // with meta only
  HD int memory() const { return alpha() + 2 * metric_size(); }  // with meta only
  HD int projections() const { return (alpha() + (meta ? 3 : 1) * metric_size() + 3) / 4 * 4; }
  enum Projection { kSS, kSR, kBeta, kMSE, kSumW, kSeen, kH, kProjectionHead = 8 };
  HD int u() const { return kProjectionHead; }
  HD int sz() const { return u() + row; }
  HD int p() const { return sz() + row; }
  HD int r() const { return p() + row; }  // the row of the matrix R, up to its diagonal
  HD int projection_size() const { return r() + row; }
  // Size with `count` projections; with many inputs and projections it exceeds an int.
  HD std::ptrdiff_t record_size(int count) const {
    return projections() + std::ptrdiff_t(count) * projection_size();
  }
};

// The options that the arithmetic of a field needs.
struct FieldSettings {
  bool update_D, meta;
  double meta_rate, penalty, add_threshold, final_lambda, tau_lambda;
};

constexpr double kSsFloor = 1e-10;      // for the sum of squared projections: prevents a division by 0
constexpr double kFirstU = 1e-10;       // initial length of a projection: the first sample turns it
constexpr double kMaxLeverage = 0.9;    // above it a leave-one-out error has no meaning
constexpr double kMaxMetricStep = 0.1;  // share of M_ii by which an entry of row i of M may change in a step
constexpr double kMaxLogRate = 50;      // limit for a learnt rate: its exponential must stay finite
constexpr int kTrustAfter = 2;          // samples per input, after which a slope is used
constexpr int kJudgeAfter = 10;         // samples per input, after which the newest projection is judged
constexpr int kMetricAfter = 20;  // samples per input, after which the metric is learnt: steps go with 1 / W

}  // namespace sdftrack::lwpr
