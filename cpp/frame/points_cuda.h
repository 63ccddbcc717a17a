// SPDX-License-Identifier: MIT
// The sums of PointOps at many poses in one launch, bit for bit those of the CPU. No CUDA header is needed to
// include this; only builds with SDFTRACK_CUDA define it.
#pragma once

#include <memory>
#include <vector>

#include "energies/cuda_work.h"
#include "frame/point_ops.h"

namespace sdftrack::frame {

struct PoseOf {
  Rigidf T_obj_cam;
  int terms;  // index of the terms that are summed at this pose
};

class PointsOnDevice {
 public:
  // On the device of `work`, with the volumes that it has.
  explicit PointsOnDevice(energies::CudaWork* work);
  ~PointsOnDevice();
  PointsOnDevice(const PointsOnDevice&) = delete;
  PointsOnDevice& operator=(const PointsOnDevice&) = delete;

  // Starts another scene. Until this call a list at an address that was sent before is taken as unchanged.
  void begin();
  // The sums for each pose, in order. The lists of the terms are in host memory.
  void linearize(const std::vector<QuickTerms>& terms, const std::vector<PoseOf>& poses,
                 std::vector<energies::Sums<double, 6>>* out);
  void cost(const std::vector<QuickTerms>& terms, const std::vector<PoseOf>& poses,
            std::vector<QuickCost>* out);

  struct Impl;

 private:
  std::unique_ptr<Impl> impl_;
};

}  // namespace sdftrack::frame
