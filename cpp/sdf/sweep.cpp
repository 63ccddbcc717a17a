// SPDX-License-Identifier: MIT
#include "sdf/sweep.h"

#include <algorithm>
#include <cstddef>

#include "base/interrupt.h"
#include "base/parallel.h"
#include "sdf/sweep_terms.h"

namespace sdftrack::sdf {

namespace {

constexpr int kRounds = 2;  // of eight sweeps: the second round corrects paths around corners
constexpr std::size_t kRowsAtOnce = 16;

// The sweeps visit rows along x. Rows with the same y + z, in the order of a sweep, do not read each other,
// so that they can be visited at once; what each reads is as in a visit of one after the other.
class Sweeps {
 public:
  // When a row last changed, and when it was last visited forwards and backwards.
  struct Row {
    std::int32_t changed = 0, visited[2] = {0, 0};
  };

  Sweeps(const Grid& grid, const std::vector<std::uint8_t>& known, int threads, std::vector<Row>* rows,
         std::vector<float>* u)
      : grid_(grid), known_(known), u_(*u), threads_(threads), rows_(*rows) {
    rows_.assign(std::size_t(grid.ny) * std::size_t(grid.nz), Row{});
  }

  // Returns whether a value fell.
  bool run(int order) {
    const bool fx = order & 1, fy = order & 2, fz = order & 4;
    const std::int32_t before = now_;
    for (int diagonal = 0; diagonal < grid_.ny + grid_.nz - 1; ++diagonal) {
      check_interrupt();
      ++now_;
      const int first = std::max(0, diagonal - grid_.ny + 1), last = std::min(diagonal, grid_.nz - 1);
      const auto count = std::size_t(last - first + 1);
      parallel_for((count + kRowsAtOnce - 1) / kRowsAtOnce, threads_, [&](std::size_t chunk) {
        const std::size_t end = std::min(count, (chunk + 1) * kRowsAtOnce);
        for (std::size_t k = chunk * kRowsAtOnce; k < end; ++k) {
          const int z = first + int(k), y = diagonal - z;
          visit(fy ? y : grid_.ny - 1 - y, fz ? z : grid_.nz - 1 - z, fx);
        }
      });
    }
    return std::any_of(rows_.begin(), rows_.end(), [&](const Row& r) { return r.changed > before; });
  }

 private:
  Row& at(int y, int z) { return rows_[std::size_t(z) * grid_.ny + y]; }

  // A visit in the same direction changes nothing if nothing that it reads has changed since the last one.
  void visit(int y, int z, bool forward) {
    Row& row = at(y, z);
    std::int32_t changed = row.changed;
    if (y > 0) changed = std::max(changed, at(y - 1, z).changed);
    if (y + 1 < grid_.ny) changed = std::max(changed, at(y + 1, z).changed);
    if (z > 0) changed = std::max(changed, at(y, z - 1).changed);
    if (z + 1 < grid_.nz) changed = std::max(changed, at(y, z + 1).changed);
    if (changed < row.visited[forward]) return;
    row.visited[forward] = now_;
    if (sweep_row(y, z, forward)) row.changed = now_;
  }

  // One row, forwards or backwards; returns whether a value fell.
  bool sweep_row(int iy, int iz, bool forward) {
    const auto nx = std::ptrdiff_t(grid_.nx);
    const std::ptrdiff_t slice = nx * grid_.ny;
    const auto start = std::ptrdiff_t(grid_.index(0, iy, iz));
    float* line = u_.data() + start;
    const std::uint8_t* fixed = known_.data() + start;
    const float h = float(grid_.voxel_m);
    // At the border the missing neighbour is replaced by the one inside.
    const float *y0 = line + (iy > 0 ? -nx : nx), *y1 = line + (iy + 1 < grid_.ny ? nx : -nx);
    const float *z0 = line + (iz > 0 ? -slice : slice), *z1 = line + (iz + 1 < grid_.nz ? slice : -slice);
    bool changed = false;
    for (std::ptrdiff_t k = 0; k < nx; ++k) {
      const std::ptrdiff_t i = forward ? k : nx - 1 - k;
      if (fixed[i]) continue;
      const float a = std::min(line[i > 0 ? i - 1 : 1], line[i + 1 < nx ? i + 1 : nx - 2]);
      const float b = std::min(y0[i], y1[i]), c = std::min(z0[i], z1[i]);
      if (std::min(a, std::min(b, c)) >= line[i]) continue;
      const float next = godunov(a, b, c, h);
      if (next < line[i]) {
        line[i] = next;
        changed = true;
      }
    }
    return changed;
  }

  const Grid& grid_;
  const std::vector<std::uint8_t>& known_;
  std::vector<float>& u_;
  int threads_;
  std::vector<Row>& rows_;
  std::int32_t now_ = 0;  // a time for each diagonal
};

}  // namespace

void fast_sweep(const Grid& grid, const std::vector<std::uint8_t>& known, int threads,
                std::vector<float>* u) {
  for (std::size_t i = 0; i < u->size(); ++i)
    if (!known[i]) (*u)[i] = kUnreached;
  thread_local std::vector<Sweeps::Row> rows;  // kept, as a reconstruction sweeps in every tenth frame
  Sweeps sweeps(grid, known, threads, &rows, u);
  for (int round = 0; round < kRounds; ++round) {
    bool changed = false;
    for (int order = 0; order < 8; ++order) changed = sweeps.run(order) || changed;
    if (!changed) break;
  }
}

}  // namespace sdftrack::sdf
