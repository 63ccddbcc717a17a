// SPDX-License-Identifier: MIT
#include "lwpr/search.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "base/to_int.h"

namespace sdftrack::lwpr {

namespace {

constexpr double kSpare = 0.25;               // of the extent, left free at each end for later fields
constexpr double kCellReach = 0.5;            // cells per reach of a median field
constexpr int kMaxCells[] = {4096, 128, 24};  // along each of 1, 2, 3 axes

constexpr double kMaxReach = 1e100;

struct Extent {
  double low, high, reach;  // of the fields with their reach; the median reach
};

Extent extent_of(int axis, const std::vector<FieldReach>& reaches) {
  Extent e{reaches[0].center[axis], reaches[0].center[axis], 0};
  std::vector<double> half;
  for (const FieldReach& r : reaches) {
    e.low = std::min(e.low, r.center[axis] - r.half[axis]);
    e.high = std::max(e.high, r.center[axis] + r.half[axis]);
    half.push_back(r.half[axis]);
  }
  std::nth_element(half.begin(), half.begin() + std::ptrdiff_t(half.size() / 2), half.end());
  e.reach = half[half.size() / 2];
  return e;
}

}  // namespace

// Chooses the axes along which the fields' spread is largest relative to their reach.
void LwprSearch::choose_axes(int n, const std::vector<FieldReach>& reaches) {
  std::vector<std::pair<double, int>> spread;
  for (int j = 0; j < n; ++j) {
    const Extent e = extent_of(j, reaches);
    const double wide = (e.high - e.low) / e.reach;
    spread.emplace_back(wide == wide ? -wide : 0, j);  // 0 / 0 cannot be ordered
  }
  std::sort(spread.begin(), spread.end());
  axes_ = std::min(n, 3);
  for (int a = 0; a < axes_; ++a) axis_[a] = spread[a].second;
}

void LwprSearch::build(int n, const std::vector<FieldReach>& reaches) {
  ready_ = false;
  for (const FieldReach& r : reaches)
    for (int j = 0; j < n; ++j)
      if (!(r.half[j] < kMaxReach && std::isfinite(r.center[j])))
        return;  // an unbounded field: all fields are evaluated
  choose_axes(n, reaches);
  std::size_t cells = 1;
  for (int a = 0; a < axes_; ++a) {
    const Extent e = extent_of(axis_[a], reaches);
    const double spare = kSpare * (e.high - e.low), length = e.high - e.low + 2 * spare;
    const double requested = std::ceil(length / (kCellReach * e.reach));
    cells_[a] = to_int_within(requested, 1, kMaxCells[axes_ - 1]);
    origin_[a] = e.low - spare;
    per_cell_[a] = cells_[a] / length;
    cells *= std::size_t(cells_[a]);
  }
  lists_.assign(cells, {});
  ready_ = true;
  for (std::size_t k = 0; k < reaches.size(); ++k)
    if (!add(int(k), reaches[k])) ready_ = false;  // an unbounded reach
}

// Cells along an axis. Rounded monotonically as in near(): places within the reach fall into these cells.
bool LwprSearch::range(int a, const FieldReach& reach, int* first, int* last) const {
  const double c = reach.center[axis_[a]], half = reach.half[axis_[a]];
  const double low = (c - half - origin_[a]) * per_cell_[a], high = (c + half - origin_[a]) * per_cell_[a];
  if (!(low >= 0 && high < cells_[a])) return false;
  *first = to_int(low), *last = to_int(high);
  return true;
}

bool LwprSearch::add(int field, const FieldReach& reach) {
  int first[3] = {}, last[3] = {};
  for (int a = 0; a < axes_; ++a)
    if (!range(a, reach, &first[a], &last[a])) return false;
  for (int i = first[0]; i <= last[0]; ++i)
    for (int j = first[1]; j <= last[1]; ++j)
      for (int k = first[2]; k <= last[2]; ++k) {
        std::size_t cell = std::size_t(i);
        if (axes_ > 1) cell = cell * std::size_t(cells_[1]) + std::size_t(j);
        if (axes_ > 2) cell = cell * std::size_t(cells_[2]) + std::size_t(k);
        std::vector<int>& list = lists_[cell];
        const auto at = std::lower_bound(list.begin(), list.end(), field);
        if (at == list.end() || *at != field) list.insert(at, field);
      }
  return true;
}

}  // namespace sdftrack::lwpr
