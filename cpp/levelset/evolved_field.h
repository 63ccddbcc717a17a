// SPDX-License-Identifier: MIT
// A shape that follows the evidence by the thesis' method: from a first shape, by steps of a gradient flow
// (docs/math/reconstruction.md, sections 4 and 7).
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

  // log_ratio: of all frames so far, including the prior. After every `redistance_every` steps and the last
  // one the field is made a signed distance again; 0: never. The field keeps its place in memory.
  void evolve(const float* log_ratio, int steps, int redistance_every, const EvolveOptions& options,
              int threads, int device = kOnCpu);
  static constexpr int kOnCpu = -1;  // otherwise the number of a GPU

  // Boxes of cells that contain the whole surface.
  std::vector<sdf::VoxelBox> surface_boxes() const;
  // Mean motion of the surface in the last call.
  double change_m() const { return change_m_; }
  // Zero on the surface; without redistancing the slope there is a result of the flow.
  const LargeArray<float>& phi() const { return phi_; }

 private:
  void measure_change(const std::vector<float>& next);

  sdf::Grid grid_;
  LargeArray<float> phi_;
  double change_m_ = 0;
};

}  // namespace sdftrack::levelset
