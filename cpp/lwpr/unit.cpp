// SPDX-License-Identifier: MIT
#include "lwpr/unit.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace sdftrack::lwpr {
namespace {

constexpr double kMostSamples =
    1e15;                        // that a field has learnt from: larger whole numbers cannot be distinguished
constexpr int kSearchFrom = 48;  // number of fields from which on a grid is faster than evaluating all

// Memory for a field's arithmetic: per learning thread, for with a full metric it is two matrices.
double* learn_scratch(const FieldLayout& at) {
  thread_local std::vector<double> room;
  const auto requested = std::size_t(scratch_size(at));
  if (room.size() < requested) room.resize(requested);
  return room.data();
}

}  // namespace

UnitSettings::UnitSettings(const LwprOptions& o)
    : field{o.update_D, o.meta, o.meta_rate, o.penalty, o.add_threshold, o.final_lambda, o.tau_lambda},
      start{o.init_lambda, o.init_alpha, std::log(o.init_alpha)},
      w_gen(o.w_gen),
      w_prune(o.w_prune),
      q_max(-2 * std::log(o.w_cutoff)) {}

LwprUnit::LwprUnit(const FieldLayout& at, const LwprOptions& o)
    : at_(at),
      settings_(o),
      init_M_(std::make_shared<const std::vector<double>>(initial_metric(o, at.n))),
      ops_(&for_isa<UnitOps>(used_isa())),
      record_stride_(at.record_size(first_projections(at))) {}

void LwprUnit::update(const double* x, double y) {
  seen_.add(y);
  const int count = active(x, &own_);
  learn(x, y, count);
  double largest = 0;
  for (int i = 0; i < count; ++i) largest = std::max(largest, own_.w[i]);
  if (largest < settings_.w_gen) {
    add_field(x);
    own_.index[0] = size() - 1, own_.w[0] = 1;
    learn(x, y, 1);
  } else if (count > 1 && largest > settings_.w_prune) {
    prune(count);
  }
  ++since_build_;
  if (!search_.ready() && size() >= kSearchFrom && since_build_ >= size()) build_search();
}

// The first `active` fields of own_ learn a sample.
void LwprUnit::learn(const double* x, double y, int active) {
  const bool requested = ops_->learn(at_, settings_.field, blocks_.data(), records_.data(), record_stride_,
                                     learn_scratch(at_), x, y, {own_.index.data(), own_.w.data()}, active);
  for (int i = 0; i < active; ++i) {
    const int k = own_.index[i];
    changed_[k] = 1;
    if (search_.ready() && settings_.field.update_D) follow(k);
    if (requested && record(k)[FieldLayout::kWanted] > 0) add_projection(k);
  }
}

void LwprUnit::add_field(const double* x) {
  const int k = size();
  reserve_fields(k + 1);
  begin_field(at_, settings_.start, init_M_->data(), x, lane_of(k), record_of(k));
  for (int r = 0; r < first_projections(at_); ++r) add_projection(k);
  if (!search_.ready()) return;
  if (k >= 2 * search_size_) {
    search_.forget();
    return;
  }
  known_M_.resize(std::size_t(k + 1) * at_.metric_size());
  known_drift2_.resize(k + 1);
  known_drift2_.back() = -1;  // not in the search yet
  follow(k);
}

void LwprUnit::add_projection(int k) {
  reserve_projections(int(record(k)[FieldLayout::kProjections]) + 1);
  begin_projection(at_, record_of(k));
}

// The last field moves to its place.
void LwprUnit::remove_field(int k) {
  const int last = size() - 1;
  move_field(at_, lane_of(last), record(last), record_stride_, lane_of(k), record_of(k));
  changed_[k] = changed_.back();
  records_.resize(last * record_stride_);
  changed_.pop_back();
  search_.forget();
}

// Removes one of the two fields that cover the sample most, if both cover it.
void LwprUnit::prune(int count) {
  int first = 0, second = -1;
  for (int i = 1; i < count; ++i) {
    const auto w = [&](int a) { return own_.w[a]; };
    if (w(i) > w(first))
      second = first, first = i;
    else if (second < 0 || w(i) > w(second))
      second = i;
  }
  if (own_.w[second] <= settings_.w_prune) return;
  const int one = own_.index[first], two = own_.index[second];
  const int a = std::min(one, two), b = std::max(one, two);
  remove_field(older_goes(at_, record(a), record(b)) ? a : b);
}

// Reserves room for this number of fields, the last of them empty.
void LwprUnit::reserve_fields(int fields) {
  const int blocks = (fields + kFieldLanes - 1) / kFieldLanes;
  const auto want = std::size_t(blocks) * at_.block_size();
  if (blocks_.size() < want) blocks_.resize(want, std::numeric_limits<double>::quiet_NaN());
  records_.resize(fields * record_stride_, 0.0);
  changed_.resize(fields, 1);
  room_in(&own_);
}

// Reserves room for this number of projections in each field.
void LwprUnit::reserve_projections(int count) {
  const std::ptrdiff_t requested = at_.record_size(count);
  if (requested <= record_stride_) return;
  std::vector<double> wider(size() * requested, 0.0);
  for (int k = 0; k < size(); ++k)
    std::copy(record(k), record(k) + record_stride_, wider.data() + k * requested);
  records_ = std::move(wider);
  record_stride_ = requested;
}

void LwprUnit::settle() {
  for (int k = 0; k < size(); ++k)
    if (changed_[k]) settle_field(k), changed_[k] = 0;
  if (!search_.ready() && size() >= kSearchFrom) build_search();
}

// The projections in a row are one linear function of x: from the last to the first, with f_r(z) = g_r . z,
// g_r = g_{r+1} + u_r (beta_r - p_r . g_{r+1}) (docs/math/lwpr.md, eq. 5).
void LwprUnit::settle_field(int k) {
  const double* const head = record(k);
  double* const lane = lane_of(k);
  double* const g = learn_scratch(at_);
  std::fill(g, g + at_.row, 0.0);
  const int T = int(head[FieldLayout::kTrusted]);
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

void LwprUnit::append_to(std::vector<double>* out) const {
  out->insert(out->end(), {double(size()), seen_.count, seen_.mean});
  for (int k = 0; k < size(); ++k) {
    for (int row = 0; row < at_.n + at_.metric_size(); ++row) out->push_back(lane(k, row));
    const double* const head = record(k);
    out->insert(out->end(), head, head + at_.record_size(int(head[FieldLayout::kProjections])));
  }
}

bool LwprUnit::read_from(const double** from, const double* end) {
  const double* at = *from;
  if (end - at < 3 || !(at[0] >= 0 && at[0] <= double(end - at) && at[0] == std::floor(at[0]))) return false;
  const int fields = int(at[0]), seen_rows = at_.n + at_.metric_size();
  LwprUnit fresh = *this;
  fresh.blocks_.clear(), fresh.records_.clear(), fresh.changed_.clear();
  fresh.search_.forget();
  fresh.seen_ = {at[1], at[2]};
  at += 3;
  for (int k = 0; k < fields; ++k) {
    if (end - at < seen_rows + FieldLayout::kHeadSize) return false;
    const double* const head = at + seen_rows;
    const double R = head[FieldLayout::kProjections], T = head[FieldLayout::kTrusted];
    if (!(R >= 1 && R <= at_.n && T >= 0 && T <= R && R == std::floor(R) && T == std::floor(T))) return false;
    if (!(head[FieldLayout::kCount] >= 0 && head[FieldLayout::kCount] <= kMostSamples)) return false;
    const std::ptrdiff_t numbers = at_.record_size(int(R));
    if (end - head < numbers) return false;
    fresh.reserve_projections(int(R));
    fresh.reserve_fields(k + 1);
    for (int row = 0; row < seen_rows; ++row) fresh.lane_of(k)[row * kFieldLanes] = at[row];
    std::copy(head, head + numbers, fresh.record_of(k));
    at = head + numbers;
  }
  fresh.settle();
  *this = std::move(fresh);
  *from = at;
  return true;
}

void LwprUnit::take(const OutputsSeen& seen, int fields, const double* blocks, const double* records,
                    std::ptrdiff_t stride) {
  const auto count = std::size_t(fields);
  seen_ = seen;
  blocks_.assign(blocks, blocks + (fields + kFieldLanes - 1) / kFieldLanes * at_.block_size());
  records_.assign(records, records + fields * stride);
  record_stride_ = stride;
  changed_.assign(count, 1);
  search_.forget();
  room_in(&own_);
  settle();
}

}  // namespace sdftrack::lwpr
