// SPDX-License-Identifier: MIT
// Finds the fields that may be active at a place: a grid over at most three inputs, where each cell lists the
// fields whose reach meets it. Only fields that are surely below the cutoff are left out, so the results
// equal those of a full search.
#pragma once

#include <vector>

namespace sdftrack::lwpr {

// The centre of a field and its reach along each input, at the cutoff.
struct FieldReach {
  const double* center;
  const double* half;
};

class LwprSearch {
 public:
  struct Fields {
    const int* list;  // in ascending order
    int count;
  };

  bool ready() const { return ready_; }
  void forget() { ready_ = false; }
  // `reaches`: one for each field 0, 1, 2, ... of n inputs.
  void build(int n, const std::vector<FieldReach>& reaches);
  // Adds a field, or extends its reach. False if it leaves the grid, which must then be built again.
  bool add(int field, const FieldReach& reach);
  // Outside the grid there are no fields, because all lie inside.
  Fields near(const double* x) const {
    std::size_t cell = 0;
    for (int a = 0; a < axes_; ++a) {
      const double at = (x[axis_[a]] - origin_[a]) * per_cell_[a];
      if (!(at >= 0 && at < cells_[a])) return {nullptr, 0};
      cell = cell * std::size_t(cells_[a]) + std::size_t(at);
    }
    const std::vector<int>& fields = lists_[cell];
    return {fields.data(), int(fields.size())};
  }

 private:
  void choose_axes(int n, const std::vector<FieldReach>& reaches);
  bool range(int a, const FieldReach& reach, int* first, int* last) const;

  bool ready_ = false;
  int axes_ = 0, axis_[3] = {}, cells_[3] = {1, 1, 1};
  double origin_[3] = {}, per_cell_[3] = {};
  std::vector<std::vector<int>> lists_;
};

}  // namespace sdftrack::lwpr
