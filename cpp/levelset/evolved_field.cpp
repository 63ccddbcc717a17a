// SPDX-License-Identifier: MIT
#include "levelset/evolved_field.h"

#include <algorithm>
#include <cmath>

#include "levelset/redistance.h"
#include "sdf/redistance.h"

namespace sdftrack::levelset {

namespace {

constexpr int kBoxSide = 8;  // cells

// Whether the field has both signs among the corners of a box of cells.
bool holds_surface(const sdf::Grid& grid, const float* phi, const sdf::VoxelBox& box) {
  bool inside = false, outside = false;
  for (int z = box.z0; z <= box.z1; ++z)
    for (int y = box.y0; y <= box.y1; ++y)
      for (int x = box.x0; x <= box.x1; ++x) {
        (phi[grid.index(x, y, z)] < 0 ? inside : outside) = true;
        if (inside && outside) return true;
      }
  return false;
}

// A field of one sign is unchanged: the shape is gone, or fills the volume.
void make_distances(const sdf::Grid& grid, int threads, int device, std::vector<float>* field) {
  const auto inside = [](float phi) { return phi < 0; };
  if (std::all_of(field->begin(), field->end(), inside) || std::none_of(field->begin(), field->end(), inside))
    return;
  *field = device == EvolvedField::kOnCpu ? sdf::redistance(grid, field->data(), threads)
                                          : redistance_cuda(grid, field->data(), device);
}

}  // namespace

EvolvedField::EvolvedField(const sdf::Grid& grid, const float* phi_m) : grid_(grid), phi_(grid.size()) {
  std::copy_n(phi_m, grid.size(), phi_.begin());
}

void EvolvedField::evolve(const float* log_ratio, int steps, int redistance_every,
                          const EvolveOptions& options, int threads, int device) {
  std::vector<float> next(phi_.begin(), phi_.end());
  const int most = redistance_every > 0 ? redistance_every : std::max(steps, 1);
  for (int left = steps; left > 0; left -= most) {
    const int now = std::min(left, most);
    next = device == kOnCpu ? levelset::evolve(grid_, next.data(), log_ratio, now, options, threads)
                            : levelset::evolve_cuda(grid_, next.data(), log_ratio, now, options, device);
    if (redistance_every > 0) make_distances(grid_, threads, device, &next);
  }
  measure_change(next);
  std::copy(next.begin(), next.end(), phi_.begin());
}

// The mean change of the field over its slope, at the voxels within one voxel of the surface.
void EvolvedField::measure_change(const std::vector<float>& next) {
  const auto voxel = float(grid_.voxel_m);
  const std::size_t row = std::size_t(grid_.nx), slice = row * std::size_t(grid_.ny);
  double sum_m = 0;
  int count = 0;
  for (int z = 1; z + 1 < grid_.nz; ++z)
    for (int y = 1; y + 1 < grid_.ny; ++y)
      for (int x = 1; x + 1 < grid_.nx; ++x) {
        const std::size_t i = grid_.index(x, y, z);
        if (!(std::abs(phi_[i]) < voxel)) continue;
        const float gx = phi_[i + 1] - phi_[i - 1], gy = phi_[i + row] - phi_[i - row],
                    gz = phi_[i + slice] - phi_[i - slice];
        const float slope = std::sqrt(gx * gx + gy * gy + gz * gz) / (2 * voxel);
        sum_m += double(std::abs(next[i] - phi_[i]) / std::max(slope, 0.1f));
        ++count;
      }
  change_m_ = count > 0 ? sum_m / count : 0;
}

std::vector<sdf::VoxelBox> EvolvedField::surface_boxes() const {
  std::vector<sdf::VoxelBox> boxes;
  for (int z = 0; z + 1 < grid_.nz; z += kBoxSide)
    for (int y = 0; y + 1 < grid_.ny; y += kBoxSide)
      for (int x = 0; x + 1 < grid_.nx; x += kBoxSide) {
        const sdf::VoxelBox box{x,
                                y,
                                z,
                                std::min(x + kBoxSide, grid_.nx - 1),
                                std::min(y + kBoxSide, grid_.ny - 1),
                                std::min(z + kBoxSide, grid_.nz - 1)};
        if (holds_surface(grid_, phi_.data(), box)) boxes.push_back(box);
      }
  return boxes;
}

}  // namespace sdftrack::levelset
