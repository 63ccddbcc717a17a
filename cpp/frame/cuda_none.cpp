// SPDX-License-Identifier: MIT
// In a build without CUDA, in place of the .cu files of this folder: the error of no_cuda.h.
#include "base/no_cuda.h"
#include "frame/points_cuda.h"
#include "frame/selection_cuda.h"

namespace sdftrack::frame {

struct PointsOnDevice::Impl {};

PointsOnDevice::PointsOnDevice(energies::CudaWork*) { no_cuda(); }
PointsOnDevice::~PointsOnDevice() = default;
void PointsOnDevice::begin() { no_cuda(); }
void PointsOnDevice::linearize(const std::vector<QuickTerms>&, const std::vector<PoseOf>&,
                               std::vector<energies::Sums<double, 6>>*) {
  no_cuda();
}
void PointsOnDevice::cost(const std::vector<QuickTerms>&, const std::vector<PoseOf>&,
                          std::vector<QuickCost>*) {
  no_cuda();
}

PixelsOnDevice choose_on_device(energies::CudaWork*, const DepthFrame&, const std::vector<Lookout>&, int) {
  no_cuda();
}

}  // namespace sdftrack::frame
