// SPDX-License-Identifier: MIT
// The fields of a unit that a sample may activate (docs/math/lwpr.md, section 4).
#include <cmath>

#include "lwpr/unit.h"

namespace sdftrack::lwpr {

namespace {

constexpr double kReachMargin = 1.15;  // factor on a field's reach in the search: it may grow a little
const int kNoField = 0;

}  // namespace

FieldList LwprUnit::fields_near(const double* x) const {
  if (!search_.ready()) return {blocks_.data(), nullptr, size()};
  const LwprSearch::Fields fields = search_.near(x);
  return {blocks_.data(), fields.list ? fields.list : &kNoField, fields.count};
}

ActiveFields LwprUnit::room_in(LwprScratch* scratch) const {
  const auto room = std::size_t(size() + kFieldLanes);
  if (scratch->index.size() < room) scratch->index.resize(2 * room), scratch->w.resize(2 * room);
  return {scratch->index.data(), scratch->w.data()};
}

int LwprUnit::active(const double* x, LwprScratch* scratch) const {
  return ops_->active(at_, fields_near(x), x, settings_.q_max, room_in(scratch));
}

// A field's reach along each input at the cutoff: the extent of |M d|^2 = q_max is sqrt(q_max) times the
// length of a row of the inverse of M.
void LwprUnit::reach_of(int k, double* half) {
  const int n = at_.n;
  const double* const lane = lane_of(k);
  const auto M = [&](int i, int j) { return lane[(n + at_.entry(i, j)) * kFieldLanes]; };
  double whole2 = 0;
  inverse_.resize(n);
  for (int i = 0; i < n; ++i) {  // row i of the inverse, from its diagonal on
    double length2 = 0;
    for (int j = i; j < (at_.diagonal ? i + 1 : n); ++j) {
      double sum = j == i ? 1 : 0;
      for (int l = i; l < j; ++l) sum -= inverse_[l] * M(l, j);
      const double entry = sum / M(j, j);
      inverse_[j] = entry;
      length2 += entry * entry;
    }
    half[i] = std::sqrt(length2 * settings_.q_max) * kReachMargin;
    whole2 += length2;
  }
  // M + E has an inverse whose rows are at most 1 / (1 - |E| |M^-1|) times as long (Frobenius norms).
  const double drift = (1 - 1 / kReachMargin) / std::sqrt(whole2);
  const auto i = std::size_t(k), size = std::size_t(at_.metric_size());
  for (std::size_t e = 0; e < size; ++e) known_M_[i * size + e] = lane[(std::size_t(n) + e) * kFieldLanes];
  known_drift2_[i] = drift * drift;
}

// Keeps the search valid after a change of a field's metric.
void LwprUnit::follow(int k) {
  const auto i = std::size_t(k), size = std::size_t(at_.metric_size());
  const double* const lane = lane_of(k) + at_.n * kFieldLanes;
  const double* const known = known_M_.data() + i * size;
  double moved2 = 0;
  for (std::size_t e = 0; e < size; ++e) {
    const double by = lane[e * kFieldLanes] - known[e];
    moved2 += by * by;
  }
  if (moved2 <= known_drift2_[i]) return;
  half_.resize(2 * at_.n);
  reach_of(k, half_.data());
  double* const center = half_.data() + at_.n;
  for (int j = 0; j < at_.n; ++j) center[j] = this->lane(k, j);
  if (!search_.add(k, {center, half_.data()})) search_.forget();
}

void LwprUnit::build_search() {
  const auto fields = std::size_t(size()), n = std::size_t(at_.n);
  known_M_.resize(fields * std::size_t(at_.metric_size()));
  known_drift2_.resize(fields);
  std::vector<double> numbers(2 * fields * n);
  std::vector<FieldReach> reaches;
  for (std::size_t k = 0; k < fields; ++k) {
    double* const half = numbers.data() + 2 * k * n;
    reach_of(int(k), half);
    for (std::size_t j = 0; j < n; ++j) half[n + j] = lane(int(k), int(j));
    reaches.push_back({half + n, half});
  }
  search_.build(at_.n, reaches);
  search_size_ = size();
  since_build_ = 0;
}

}  // namespace sdftrack::lwpr
