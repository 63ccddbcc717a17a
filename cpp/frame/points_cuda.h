// SPDX-License-Identifier: MIT
// The sums of PointOps at many poses in one launch, to the bits of the CPU's. No CUDA header is needed to
// include this; only builds with SDFTRACK_CUDA define it.
#pragma once

#include <memory>
#include <vector>

#include "energies/cuda_work.h"
#include "frame/point_ops.h"

namespace sdftrack::frame {

struct PoseOf {
  Rigidf T_obj_cam;
  int terms;  // which of them are summed there
};

class PointsOnDevice {
 public:
  // On the device of `work`, with the volumes that it has.
  explicit PointsOnDevice(energies::CudaWork* work);
  ~PointsOnDevice();
  PointsOnDevice(const PointsOnDevice&) = delete;
  PointsOnDevice& operator=(const PointsOnDevice&) = delete;

  // Another scene: a list that was sent is taken for the same by its address until this is called.
  void begin();
  // Of each pose, in order. The lists of the terms lie in the host's memory.
  void linearize(const std::vector<QuickTerms>& terms, const std::vector<PoseOf>& poses,
                 std::vector<energies::Sums<double, 6>>* out);
  void cost(const std::vector<QuickTerms>& terms, const std::vector<PoseOf>& poses,
            std::vector<QuickCost>* out);

  struct Impl;

 private:
  std::unique_ptr<Impl> impl_;
};

}  // namespace sdftrack::frame
