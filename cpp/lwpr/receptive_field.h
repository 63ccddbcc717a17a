// SPDX-License-Identifier: MIT
// The update of a receptive field by a sample: regression by projections, and the leave-one-out cost. The
// equations are in docs/math/lwpr.md; tests/reference/lwpr.py is a slow, plain implementation. Included only
// by files that are compiled for one instruction set.
#pragma once

#include <cmath>
#include <cstring>

#include "lwpr/metric_step.h"

namespace sdftrack::lwpr {
namespace {

#ifdef SDFTRACK_NO_PACKS  // for a compiler without vector types
struct Four {
  double v[4];
  HD double operator[](int k) const { return v[k]; }
  HD friend Four operator*(const Four& a, const Four& b) {
    return {{a[0] * b[0], a[1] * b[1], a[2] * b[2], a[3] * b[3]}};
  }
  HD friend Four operator*(double k, const Four& a) { return {{k * a[0], k * a[1], k * a[2], k * a[3]}}; }
  HD friend Four operator+(const Four& a, const Four& b) {
    return {{a[0] + b[0], a[1] + b[1], a[2] + b[2], a[3] + b[3]}};
  }
  HD Four& operator+=(const Four& b) { return *this = *this + b; }
};
#else
using Four = double __attribute__((vector_size(32)));
#endif

// Rows are aligned as doubles only.
HD Four load_four(const double* p) {
  Four x;
  memcpy(&x, p, sizeof(x));
  return x;
}

// Loops over a row of n numbers: unrolled for n = N, else packs of four with zeros at the end.
template <int N>
struct Rows {
  HD static int size(const FieldLayout& at) { return N > 0 ? N : at.row; }

  HD static double dot(const double* a, const double* b, int row) {
    if constexpr (N > 0) {
      double sum = a[0] * b[0];
      for (int j = 1; j < N; ++j) sum += a[j] * b[j];
      return sum;
    } else {
      Four sum{};
      for (int j = 0; j < row; j += 4) sum += load_four(a + j) * load_four(b + j);
      return (sum[0] + sum[1]) + (sum[2] + sum[3]);
    }
  }
  // a <- ka a + kb b
  HD static void mix(double ka, double* a, double kb, const double* b, int row) {
    if constexpr (N > 0) {
      for (int j = 0; j < N; ++j) a[j] = ka * a[j] + kb * b[j];
    } else {
      for (int j = 0; j < row; j += 4) {
        const Four mixed = ka * load_four(a + j) + kb * load_four(b + j);
        memcpy(a + j, &mixed, sizeof(mixed));
      }
    }
  }
};

template <int N>
class FieldUpdate {
 public:
  HD FieldUpdate(const FieldLayout& at, const FieldSettings& o, double* lane, double* record, double* scratch)
      : at_(at),
        o_(o),
        n_(N > 0 ? N : at.n),
        row_(Rows<N>::size(at)),
        lane_(lane),
        head_(record),
        z_(scratch),
        s_(scratch + row_),
        ps_(scratch + 2 * row_),
        d_(scratch + 3 * row_) {}

  // Learns a sample x (a whole row: zeros at the end) with the value y and the activation w. Returns true if
  // another projection is needed.
  HD bool learn(const double* x, double y, double w) {
    const int R = N == 1 || N == 2 ? N : int(head_[FieldLayout::kProjections]);
    const double e = regress(x, y, w, R);
    const int T = trusted();
    if (T > 0) judge(x, e, w, N == 1 || N == 2 ? N : T);
    head_[FieldLayout::kLambda] =
        o_.tau_lambda * head_[FieldLayout::kLambda] + (1 - o_.tau_lambda) * o_.final_lambda;
    if (N == 1 || N == 2) return false;
    if (!wants_projection(R)) return false;
    head_[FieldLayout::kWanted] = 1;
    return true;
  }

 private:
  HD double* projection(int r) const { return head_ + at_.record_size(r); }
  HD int trusted() const { return int(head_[FieldLayout::kTrusted]); }

  // Eqs. 2 to 4. Returns the residual after the projections that are trusted.
  HD double regress(const double* x, double y, double w, int R) {
    const double lambda = head_[FieldLayout::kLambda], before = lambda * head_[FieldLayout::kW];
    const double W = before + w, inv_W = 1 / W;
    double* const mean = head_ + at_.mean();
    Rows<N>::mix(before * inv_W, mean, w * inv_W, x, row_);
    const double beta0 = (before * head_[FieldLayout::kBeta0] + w * y) * inv_W;
    head_[FieldLayout::kW] = W;
    head_[FieldLayout::kBeta0] = beta0;
    head_[FieldLayout::kCount] += 1;
    for (int j = 0; j < row_; ++j) z_[j] = x[j] - mean[j];
    double residual = y - beta0, e = residual;
    int T = trusted();
    for (int r = 0; r < R; ++r) {
      residual = project(projection(r), residual, lambda, w, r);
      if (r == T && projection(r)[FieldLayout::kSeen] > kTrustAfter * n_) T = r + 1;
      if (r < T) e = residual;
    }
    head_[FieldLayout::kTrusted] = T;
    return e;
  }

  HD double project(double* pr, double residual, double lambda, double w, int r) {
    double *const u = pr + at_.u(), *const sz = pr + at_.sz(), *const p = pr + at_.p();
    const double length2 = Rows<N>::dot(u, u, row_);
    const double s = length2 > 0 ? Rows<N>::dot(z_, u, row_) / std::sqrt(length2) : 0.0;
    const double ss = lambda * pr[FieldLayout::kSS] + w * s * s;
    const double SS = ss > kSsFloor ? ss : kSsFloor, inv_SS = 1 / SS;
    const double SR = lambda * pr[FieldLayout::kSR] + w * s * residual, beta = SR * inv_SS;
    Rows<N>::mix(lambda, sz, w * s, z_, row_);
    Rows<N>::mix(lambda, u, w * residual, z_, row_);
    for (int j = 0; j < row_; ++j) p[j] = sz[j] * inv_SS;
    for (int j = 0; j < row_; ++j) z_[j] -= s * p[j];
    residual -= s * beta;
    pr[FieldLayout::kSS] = SS;
    pr[FieldLayout::kSR] = SR;
    pr[FieldLayout::kBeta] = beta;
    pr[FieldLayout::kMSE] = lambda * pr[FieldLayout::kMSE] + w * residual * residual;
    pr[FieldLayout::kSumW] = lambda * pr[FieldLayout::kSumW] + w;
    pr[FieldLayout::kSeen] += 1;
    s_[r] = s;
    ps_[r] = s * inv_SS;
    return residual;
  }

  // The leave-one-out cost and its slope with respect to the activation (eqs. 6 and 7).
  HD void judge(const double* x, double e, double w, int T) {
    const double lambda = head_[FieldLayout::kLambda];
    double h = 0;
    for (int r = 0; r < T; ++r) h += s_[r] * ps_[r];
    h = w * h;
    const double s_P_s = h / w;
    if (h > kMaxLeverage) h = kMaxLeverage;
    const double inv = 1 / (1 - h), e_cv = e * inv, e_cv2 = e_cv * e_cv;
    const double W = lambda * head_[FieldLayout::kLooW] + w;
    const double E = lambda * head_[FieldLayout::kLooE] + w * e_cv2;
    head_[FieldLayout::kLooW] = W;
    head_[FieldLayout::kLooE] = E;
    head_[FieldLayout::kLeverage] = lambda * head_[FieldLayout::kLeverage] + w * h;
    const double for_H = w * e_cv * inv, for_R = w * w * e_cv2 * inv;
    double ps_H = 0, ps_R_ps = 0;
    for (int r = 0; r < T; ++r) {
      double* const pr = projection(r);
      double* const R = pr + at_.r();
      const double H = lambda * pr[FieldLayout::kH] + for_H * s_[r];
      pr[FieldLayout::kH] = H;
      ps_H += ps_[r] * H;
      double beside = 0;
      for (int q = 0; q < r; ++q) {
        R[q] = lambda * R[q] + for_R * s_[r] * s_[q];
        beside += R[q] * ps_[q];
      }
      R[r] = lambda * R[r] + for_R * s_[r] * s_[r];
      ps_R_ps += ps_[r] * (2 * beside + R[r] * ps_[r]);
    }
    if (!o_.update_D || head_[FieldLayout::kCount] < kMetricAfter * n_) return;
    const double inv_W = 1 / W;
    const double slope = (e_cv2 * (1 + h) * inv - 2 * e * ps_H - 2 * ps_R_ps) * inv_W - E * inv_W * inv_W;
    const double curve = (2 * e * e_cv * s_P_s - 2 * slope) * inv_W;
    for (int j = 0; j < n_; ++j) d_[j] = x[j] - lane_[j * kFieldLanes];
    MetricStep<N>(at_, o_, lane_, head_, d_, d_ + row_)
        .take({w, slope, curve, w * inv_W * 4 * o_.penalty / n_});
  }

  HD bool wants_projection(int R) const {
    if (R < 2 || R >= n_) return false;
    const double *const last = projection(R - 1), *const one = projection(R - 2);
    if (last[FieldLayout::kSeen] <= kJudgeAfter * n_) return false;
    return last[FieldLayout::kMSE] / last[FieldLayout::kSumW] <
           o_.add_threshold * one[FieldLayout::kMSE] / one[FieldLayout::kSumW];
  }

  const FieldLayout& at_;
  const FieldSettings& o_;
  int n_, row_;
  double *lane_, *head_, *z_, *s_, *ps_, *d_;
};

}  // namespace
}  // namespace sdftrack::lwpr
