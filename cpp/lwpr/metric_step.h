// SPDX-License-Identifier: MIT
// A step of a field's metric down the gradient of the penalised leave-one-out cost (docs/math/lwpr.md, eq. 8,
// 10). Included only by files that are compiled for one instruction set.
#pragma once

#include <cmath>

#include "lwpr/layout.h"

namespace sdftrack::lwpr {
namespace {

// The effect of a sample on the metric: its activation, the slope and the curvature of the cost with respect
// to the activation, and the weight of the penalty's gradient M D.
struct MetricPull {
  double w, slope, curve, shrink;
};

template <int N>
class MetricStep {
 public:
  // d = x - centre; scratch: a row, and twice n x n numbers (none of the latter for N > 0).
  HD MetricStep(const FieldLayout& at, const FieldSettings& o, double* lane, double* head, const double* d,
                double* scratch)
      : at_(at),
        o_(o),
        n_(N > 0 ? N : at.n),
        metric_(lane + n_ * kFieldLanes),
        head_(head),
        d_(d),
        md_(scratch) {}

  HD void take(const MetricPull& pull) {
    if (at_.diagonal) {
      for (int i = 0; i < n_; ++i) {
        const double m = metric(i);
        move(i, i, pull, m, m * d_[i], m * m * m, 3 * m * m);
      }
      return;
    }
    for (int i = 0; i < n_; ++i) {
      md_[i] = 0;
      for (int j = i; j < n_; ++j) md_[i] += metric(at_.entry(i, j)) * d_[j];
    }
    if (pull.shrink > 0 || o_.meta)
      full_penalised(pull);
    else
      full(pull);
  }

 private:
  HD double& metric(int k) const { return metric_[k * kFieldLanes]; }

  HD void full(const MetricPull& pull) {
    for (int i = 0; i < n_; ++i) {
      const double size = metric(at_.entry(i, i));
      for (int j = i; j < n_; ++j) move(at_.entry(i, j), j, pull, size, md_[i], 0, 0);
    }
  }

  // The penalty needs M D of the metric before the step, so both are computed first.
  HD void full_penalised(const MetricPull& pull) {
    constexpr int kSize = N > 0 ? N * N : 1;
    double small[2 * kSize];
    double* const D = N > 0 ? small : md_ + at_.row;
    double* const M = D + (N > 0 ? kSize : n_ * n_);
    for (int i = 0; i < n_; ++i)
      for (int j = 0; j < n_; ++j) M[i * n_ + j] = j < i ? 0.0 : metric(at_.entry(i, j));
    for (int i = 0; i < n_; ++i)
      for (int j = i; j < n_; ++j) {
        double sum = 0;
        for (int k = 0; k <= i; ++k) sum += M[k * n_ + i] * M[k * n_ + j];
        D[i * n_ + j] = D[j * n_ + i] = sum;
      }
    for (int i = 0; i < n_; ++i) {
      double row2 = 0;
      for (int k = i; k < n_; ++k) row2 += M[i * n_ + k] * M[i * n_ + k];
      for (int j = i; j < n_; ++j) {
        double MD = 0;
        for (int k = i; k < n_; ++k) MD += M[i * n_ + k] * D[k * n_ + j];
        const double second = D[j * n_ + j] + M[i * n_ + j] * M[i * n_ + j] + row2;
        move(at_.entry(i, j), j, pull, M[i * n_ + i], md_[i], MD, second);
      }
    }
  }

  // Entry k of the metric, in column j of a row whose diagonal is `size`; md: that row of M d.
  HD void move(int k, int j, const MetricPull& pull, double size, double md, double MD, double second) {
    const double dw = -pull.w * md * d_[j], gradient = pull.slope * dw + pull.shrink * MD;
    double& alpha = head_[at_.alpha() + k];
    if (o_.meta) {
      const double ddw = pull.w * (md * md - 1) * d_[j] * d_[j];
      alpha = adapted(k, gradient, pull.curve * dw * dw + pull.slope * ddw + pull.shrink * second);
    }
    const double by = -alpha * gradient, most = kMaxMetricStep * size;
    metric(k) += by > most ? most : (by < -most ? -most : by);
  }

  // Sutton's incremental delta-bar-delta.
  HD double adapted(int k, double gradient, double second) {
    double& log_alpha = head_[at_.log_alpha() + k];
    double& memory = head_[at_.memory() + k];
    log_alpha -= o_.meta_rate * gradient * memory;
    if (log_alpha > kMaxLogRate) log_alpha = kMaxLogRate;
    if (log_alpha < -kMaxLogRate) log_alpha = -kMaxLogRate;
    const double alpha = std::exp(log_alpha), keep = 1 - alpha * second;
    memory = memory * (keep > 0 ? (keep < 1 ? keep : 1) : 0) - alpha * gradient;
    return alpha;
  }

  const FieldLayout& at_;
  const FieldSettings& o_;
  int n_;
  double *metric_, *head_;
  const double* d_;
  double* md_;
};

}  // namespace
}  // namespace sdftrack::lwpr
