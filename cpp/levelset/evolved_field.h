// SPDX-License-Identifier: MIT
// A shape that follows the evidence as the thesis moves it: from a first shape on, by steps of its gradient
// flow (docs/math/reconstruction.md, sections 4 and 7).
#pragma once

#include <vector>

#include "base/large_array.h"
#include "levelset/evolve.h"
#include "sdf/surface_samples.h"

namespace sdftrack::levelset {

class EvolvedField {
 public:
  // phi_m: signed distance of the first shape, by voxel.
  EvolvedField(const sdf::Grid& grid, const float* phi_m);

  // log_ratio: of all frames so far, the first guess among it. The field stays where it is in memory.
  void evolve(const float* log_ratio, int steps, const EvolveOptions& options, int threads,
              int device = kOnCpu);
  static constexpr int kOnCpu = -1;  // else the number of a GPU

  // Boxes of cells that hold all of the surface.
  std::vector<sdf::VoxelBox> surface_boxes() const;
  // How far the surface moved in the last call, on the mean.
  double change_m() const { return change_m_; }
  // Zero on the surface, but no distance: its slope there is what the flow has made of it.
  const LargeArray<float>& phi() const { return phi_; }

 private:
  void measure_change(const std::vector<float>& next);

  sdf::Grid grid_;
  LargeArray<float> phi_;
  double change_m_ = 0;
};

}  // namespace sdftrack::levelset
