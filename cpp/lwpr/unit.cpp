// SPDX-License-Identifier: MIT
#include "lwpr/unit.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace sdftrack {

LwprUnit::LwprUnit(const FieldLayout& at, const LwprOptions& o)
    : at_(at),
      settings_{o.update_D, o.meta, o.meta_rate, o.penalty, o.add_threshold, o.final_lambda, o.tau_lambda},
      w_gen_(o.w_gen),
      w_prune_(o.w_prune),
      q_max_(-2 * std::log(o.w_cutoff)),
      init_lambda_(o.init_lambda),
      init_alpha_(o.init_alpha),
      init_M_(initial_metric(o, at.n)),
      ops_(&for_isa<UnitOps>(used_isa())),
      learn_scratch_(static_cast<std::size_t>(scratch_size(at))) {}

int LwprUnit::active(const double* x, LwprScratch* scratch) const {
  const auto room = static_cast<std::size_t>(size() + kFieldLanes);
  if (scratch->index.size() < room) scratch->index.resize(2 * room), scratch->w.resize(2 * room);
  return ops_->active(at_, all_blocks(), x, q_max_, scratch->index.data(), scratch->w.data());
}

void LwprUnit::update(const double* x, double y) {
  seen_ += 1;
  mean_y_ += (y - mean_y_) / seen_;
  const int count = active(x, &own_);
  double largest = 0;
  for (int i = 0; i < count; ++i) {
    const auto k = static_cast<std::size_t>(i);
    learn(own_.index[k], x, y, own_.w[k]);
    largest = std::max(largest, own_.w[k]);
  }
  if (largest < w_gen_) {
    add_field(x);
    learn(size() - 1, x, y, 1.0);
  } else if (count > 1 && largest > w_prune_) {
    prune(count);
  }
}

void LwprUnit::learn(int k, const double* x, double y, double w) {
  const auto i = static_cast<std::size_t>(k);
  changed_[i] = 1;
  if (ops_->learn(at_, settings_, lane_of(k), records_[i].data(), learn_scratch_.data(), x, y, w))
    add_projection(k);
}

void LwprUnit::add_field(const double* x) {
  const int k = size();
  reserve_lanes(k + 1);
  double* const lane = lane_of(k);
  for (int row = 0; row < at_.block_rows(); ++row) lane[row * kFieldLanes] = 0;
  for (int j = 0; j < at_.n; ++j) lane[j * kFieldLanes] = x[j];
  for (int j = 0; j < at_.metric_size(); ++j)
    lane[(at_.n + j) * kFieldLanes] = init_M_[static_cast<std::size_t>(j)];
  std::vector<double> record(static_cast<std::size_t>(at_.record_size(0)), 0.0);
  record[FieldLayout::kLambda] = init_lambda_;
  for (int j = 0; j < at_.metric_size(); ++j) {
    record[static_cast<std::size_t>(at_.alpha() + j)] = init_alpha_;
    if (at_.meta) record[static_cast<std::size_t>(at_.log_alpha() + j)] = std::log(init_alpha_);
  }
  records_.push_back(std::move(record));
  changed_.push_back(1);
  for (int r = 0; r < std::min(2, at_.n); ++r) add_projection(k);
}

// It starts along an axis: u_r = e_r (u = 0 would give 0 / 0).
void LwprUnit::add_projection(int k) {
  std::vector<double>& record = records_[static_cast<std::size_t>(k)];
  const int r = static_cast<int>(record[FieldLayout::kProjections]);
  record.resize(static_cast<std::size_t>(at_.record_size(r + 1)), 0.0);
  record[FieldLayout::kProjections] = r + 1;
  double* const projection = record.data() + at_.record_size(r);
  projection[FieldLayout::kSS] = kSsFloor;
  projection[at_.u() + r] = 1;
}

// The last field takes its place.
void LwprUnit::remove_field(int k) {
  const int last = size() - 1;
  const auto i = static_cast<std::size_t>(k);
  double *const to = lane_of(k), *const from = lane_of(last);
  for (int row = 0; row < at_.block_rows(); ++row) to[row * kFieldLanes] = from[row * kFieldLanes];
  for (int j = 0; j < at_.n; ++j) from[j * kFieldLanes] = std::numeric_limits<double>::quiet_NaN();
  std::swap(records_[i], records_.back());
  changed_[i] = changed_.back();
  records_.pop_back();
  changed_.pop_back();
}

// Of two fields that both cover the sample the one with the larger error goes; else the younger one.
void LwprUnit::prune(int count) {
  int first = 0, second = -1;
  for (int i = 1; i < count; ++i) {
    const auto w = [&](int a) { return own_.w[static_cast<std::size_t>(a)]; };
    if (w(i) > w(first))
      second = first, first = i;
    else if (second < 0 || w(i) > w(second))
      second = i;
  }
  if (own_.w[static_cast<std::size_t>(second)] <= w_prune_) return;
  const int one = own_.index[static_cast<std::size_t>(first)],
            two = own_.index[static_cast<std::size_t>(second)];
  const int a = std::min(one, two), b = std::max(one, two);
  const double *const A = record(a), *const B = record(b);
  const int ta = static_cast<int>(A[FieldLayout::kTrusted]), tb = static_cast<int>(B[FieldLayout::kTrusted]);
  bool older_goes = tb > 0;
  if (ta > 0 && tb > 0)
    older_goes = A[at_.record_size(ta - 1) + FieldLayout::kMSE] * B[FieldLayout::kW] >
                 B[at_.record_size(tb - 1) + FieldLayout::kMSE] * A[FieldLayout::kW];
  remove_field(older_goes ? a : b);
}

void LwprUnit::reserve_lanes(int fields) {
  const int blocks = (fields + kFieldLanes - 1) / kFieldLanes;
  const auto want = static_cast<std::size_t>(blocks) * static_cast<std::size_t>(at_.block_size());
  if (blocks_.size() < want) blocks_.resize(want, std::numeric_limits<double>::quiet_NaN());
}

void LwprUnit::settle() {
  for (int k = 0; k < size(); ++k)
    if (changed_[static_cast<std::size_t>(k)]) settle_field(k), changed_[static_cast<std::size_t>(k)] = 0;
}

// The projections in a row are one linear function of x: from the last to the first, with f_r(z) = g_r . z,
// g_r = g_{r+1} + u_r (beta_r - p_r . g_{r+1}) (docs/math/lwpr.md, eq. 5).
void LwprUnit::settle_field(int k) {
  const double* const head = record(k);
  double* const lane = lane_of(k);
  double* const g = learn_scratch_.data();
  std::fill(g, g + at_.row, 0.0);
  const int T = static_cast<int>(head[FieldLayout::kTrusted]);
  for (int r = T - 1; r >= 0; --r) {
    const double* const pr = head + at_.record_size(r);
    const double *const u = pr + at_.u(), *const p = pr + at_.p();
    double length2 = 0, pg = 0;
    for (int j = 0; j < at_.n; ++j) length2 += u[j] * u[j], pg += p[j] * g[j];
    const double by = length2 > 0 ? (pr[FieldLayout::kBeta] - pg) / std::sqrt(length2) : 0.0;
    for (int j = 0; j < at_.n; ++j) g[j] += by * u[j];
  }
  double value = head[FieldLayout::kBeta0];
  for (int j = 0; j < at_.n; ++j) {
    lane[(at_.slope() + j) * kFieldLanes] = g[j];
    value += g[j] * (lane[j * kFieldLanes] - head[at_.mean() + j]);
  }
  lane[at_.value() * kFieldLanes] = value;
  lane[at_.ready() * kFieldLanes] = T > 0 ? 1 : 0;
}

double LwprUnit::predict(const double* x, LwprScratch* scratch) const {
  const FieldSums sums = ops_->predict(at_, all_blocks(), x, q_max_);
  return sums.w > 0 ? sums.wy / sums.w : predict_with_sd(x, scratch).mean;
}

namespace {

// s^T P s of x in a field's projections.
double leverage(const FieldLayout& at, const double* head, const double* x, std::vector<double>* z) {
  z->resize(static_cast<std::size_t>(at.n));
  for (int j = 0; j < at.n; ++j) (*z)[static_cast<std::size_t>(j)] = x[j] - head[at.mean() + j];
  double sum = 0;
  for (int r = 0; r < static_cast<int>(head[FieldLayout::kTrusted]); ++r) {
    const double* const pr = head + at.record_size(r);
    double length2 = 0, s = 0;
    for (int j = 0; j < at.n; ++j) {
      const double u = pr[at.u() + j];
      length2 += u * u, s += (*z)[static_cast<std::size_t>(j)] * u;
    }
    s = length2 > 0 ? s / std::sqrt(length2) : 0.0;
    sum += s * s / pr[FieldLayout::kSS];
    for (int j = 0; j < at.n; ++j) (*z)[static_cast<std::size_t>(j)] -= s * pr[at.p() + j];
  }
  return sum;
}

// Of the noise of a field that is ready.
double noise_variance(const FieldLayout& at, const double* head) {
  const double* const pr = head + at.record_size(static_cast<int>(head[FieldLayout::kTrusted]) - 1);
  const double W = pr[FieldLayout::kSumW];
  return pr[FieldLayout::kMSE] / std::max(W - head[FieldLayout::kLeverage], (1 - kMostLeverage) * W);
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
    const int k = scratch->index[static_cast<std::size_t>(i)];
    const double w = scratch->w[static_cast<std::size_t>(i)];
    if (lane(k, at_.ready()) > 0)
      w_sum += w, wy += w * field_says(k);
    else
      young_w += w, young_wy += w * record(k)[FieldLayout::kBeta0];
  }
  const double unknown = std::numeric_limits<double>::infinity();
  if (!(w_sum > 0)) return {young_w > 0 ? young_wy / young_w : mean_y_, unknown};
  const double mean = wy / w_sum;
  double variance = 0;
  for (int i = 0; i < count; ++i) {
    const int k = scratch->index[static_cast<std::size_t>(i)];
    const double w = scratch->w[static_cast<std::size_t>(i)];
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
  for (int i = 0; i < count; ++i) largest = std::max(largest, scratch->w[static_cast<std::size_t>(i)]);
  return largest;
}

double LwprUnit::training_error() const {
  double squares = 0, weights = 0;
  for (int k = 0; k < size(); ++k) {
    const double* const head = record(k);
    const double* const last = head + at_.record_size(static_cast<int>(head[FieldLayout::kProjections]) - 1);
    squares += last[FieldLayout::kMSE], weights += last[FieldLayout::kSumW];
  }
  return weights > 0 ? std::sqrt(squares / weights) : 0.0;
}

void LwprUnit::append_to(std::vector<double>* out) const {
  out->insert(out->end(), {static_cast<double>(size()), seen_, mean_y_});
  for (int k = 0; k < size(); ++k) {
    for (int row = 0; row < at_.n + at_.metric_size(); ++row) out->push_back(lane(k, row));
    const std::vector<double>& record = records_[static_cast<std::size_t>(k)];
    out->insert(out->end(), record.begin(), record.end());
  }
}

bool LwprUnit::read_from(const double** from, const double* end) {
  const double* at = *from;
  if (end - at < 3 || !(at[0] >= 0 && at[0] <= static_cast<double>(end - at))) return false;
  const int fields = static_cast<int>(at[0]), seen_rows = at_.n + at_.metric_size();
  LwprUnit fresh = *this;
  fresh.blocks_.clear(), fresh.records_.clear();
  fresh.seen_ = at[1], fresh.mean_y_ = at[2];
  at += 3;
  fresh.changed_.assign(static_cast<std::size_t>(fields), 1);
  for (int k = 0; k < fields; ++k) {
    if (end - at < seen_rows + FieldLayout::kHeadSize) return false;
    const double* const head = at + seen_rows;
    const double R = head[FieldLayout::kProjections], T = head[FieldLayout::kTrusted];
    if (!(R >= 1 && R <= at_.n && T >= 0 && T <= R)) return false;
    const int size = at_.record_size(static_cast<int>(R));
    if (end - head < size) return false;
    fresh.reserve_lanes(k + 1);
    for (int row = 0; row < seen_rows; ++row) fresh.lane_of(k)[row * kFieldLanes] = at[row];
    fresh.records_.emplace_back(head, head + size);
    at = head + size;
  }
  fresh.settle();
  *this = std::move(fresh);
  *from = at;
  return true;
}

}  // namespace sdftrack
