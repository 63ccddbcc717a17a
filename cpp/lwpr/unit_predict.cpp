// SPDX-License-Identifier: MIT
// The prediction of a unit at a place (docs/math/lwpr.md, eqs. 11 to 13).
#include <algorithm>
#include <cmath>
#include <limits>

#include "lwpr/unit.h"

namespace sdftrack::lwpr {

double LwprUnit::predict(const double* x, LwprScratch* scratch) const {
  const FieldSums sums = ops_->predict(at_, fields_near(x), x, settings_.q_max, room_in(scratch));
  return sums.w > 0 ? sums.wy / sums.w : predict_with_sd(x, scratch).mean;
}

namespace {

// s^T P s of x in a field's projections.
double leverage(const FieldLayout& at, const double* head, const double* x, std::vector<double>* z) {
  z->resize(std::size_t(at.n));
  for (int j = 0; j < at.n; ++j) (*z)[j] = x[j] - head[at.mean() + j];
  double sum = 0;
  for (int r = 0; r < int(head[FieldLayout::kTrusted]); ++r) {
    const double* const pr = head + at.record_size(r);
    double length2 = 0, s = 0;
    for (int j = 0; j < at.n; ++j) {
      const double u = pr[at.u() + j];
      length2 += u * u, s += (*z)[j] * u;
    }
    s = length2 > 0 ? s / std::sqrt(length2) : 0.0;
    sum += s * s / pr[FieldLayout::kSS];
    for (int j = 0; j < at.n; ++j) (*z)[j] -= s * pr[at.p() + j];
  }
  return sum;
}

double noise_variance(const FieldLayout& at, const double* head) {
  const double* const pr = head + at.record_size(int(head[FieldLayout::kTrusted]) - 1);
  const double W = pr[FieldLayout::kSumW];
  return pr[FieldLayout::kMSE] / std::max(W - head[FieldLayout::kLeverage], (1 - kMaxLeverage) * W);
}

}  // namespace

LwprPrediction LwprUnit::predict_with_sd(const double* x, LwprScratch* scratch) const {
  const int count = active(x, scratch);
  double w_sum = 0, wy = 0, young_w = 0, young_wy = 0;
  const auto field_says = [&](int k) {
    double y = lane(k, at_.value());
    for (int j = 0; j < at_.n; ++j) y += (x[j] - lane(k, j)) * lane(k, at_.slope() + j);
    return y;
  };
  for (int i = 0; i < count; ++i) {
    const int k = scratch->index[i];
    const double w = scratch->w[i];
    if (lane(k, at_.ready()) > 0)
      w_sum += w, wy += w * field_says(k);
    else
      young_w += w, young_wy += w * record(k)[FieldLayout::kBeta0];
  }
  const double unknown = std::numeric_limits<double>::infinity();
  if (!(w_sum > 0)) return {young_w > 0 ? young_wy / young_w : seen_.mean, unknown};
  const double mean = wy / w_sum;
  double variance = 0;
  for (int i = 0; i < count; ++i) {
    const int k = scratch->index[i];
    const double w = scratch->w[i];
    if (!(lane(k, at_.ready()) > 0)) continue;
    const double off = field_says(k) - mean;
    variance += w * off * off +
                w * noise_variance(at_, record(k)) * (1 + w * leverage(at_, record(k), x, &scratch->row));
  }
  return {mean, std::sqrt(variance) / w_sum};
}

double LwprUnit::largest_activation(const double* x, LwprScratch* scratch) const {
  const int count = active(x, scratch);
  double largest = 0;
  for (int i = 0; i < count; ++i) largest = std::max(largest, scratch->w[i]);
  return largest;
}

double LwprUnit::training_error() const {
  double squares = 0, weights = 0;
  for (int k = 0; k < size(); ++k) {
    const double* const head = record(k);
    const double* const last = head + at_.record_size(int(head[FieldLayout::kProjections]) - 1);
    squares += last[FieldLayout::kMSE], weights += last[FieldLayout::kSumW];
  }
  return weights > 0 ? std::sqrt(squares / weights) : 0.0;
}

}  // namespace sdftrack::lwpr
