// SPDX-License-Identifier: MIT
// In a build without CUDA, in place of the .cu files of this folder: the error of no_cuda.h.
#include "base/no_cuda.h"
#include "energies/cuda_work.h"
#include "energies/joint_fits.h"
#include "energies/pose_fits.h"

namespace sdftrack::energies {

template <class Field, class Penalty>
int CudaPoseFits<Field, Penalty>::run(CudaWork*, std::vector<Problem>*, std::vector<Fit>*,
                                      std::vector<optim::LmStep>*, int, PixelSet*) {
  no_cuda();
}
template struct CudaPoseFits<SingleObject<float>, DepthLogistic<float>>;
template struct CudaPoseFits<ScaledObject<float>, DepthLogistic<float>>;
template struct CudaPoseFits<SingleObject<float>, ColorOdds<float>>;
template struct CudaPoseFits<SingleObject<float>, ColorPrinted<float>>;

void fit_together(CudaWork*, const JointTask&, JointFound*) { no_cuda(); }

struct CudaWork::Impl {};

CudaWork::CudaWork(int) { no_cuda(); }
CudaWork::~CudaWork() = default;
PixelsView<float> CudaWork::upload(const PixelSet&) { no_cuda(); }
PixelsView<float> CudaWork::make_room(int) { no_cuda(); }
void CudaWork::download(PixelSet*) { no_cuda(); }
void CudaWork::check_uploaded(const PixelSet&) const { no_cuda(); }
SdfView CudaWork::volume(const SdfView&) { no_cuda(); }
ColorView CudaWork::colors(const SdfView&, const ColorView&) { no_cuda(); }
void CudaWork::keep_volumes(std::size_t) { no_cuda(); }
const DeviceStream& CudaWork::stream() const { no_cuda(); }
int CudaWork::device() const { no_cuda(); }

template <class Field, class Penalty>
Sums<double, Field::P> CudaOps<Field, Penalty>::linearize(CudaWork*, const Loop&) {
  no_cuda();
}
template <class Field, class Penalty>
double CudaOps<Field, Penalty>::cost(CudaWork*, const Loop&) {
  no_cuda();
}
template <class Field, class Penalty>
void CudaOps<Field, Penalty>::settle(CudaWork*, const Loop&, int) {
  no_cuda();
}
#define SDFTRACK_PAIR(name, field, penalty) template struct CudaOps<field, penalty>;
#include "energies/compiled.inc"
#undef SDFTRACK_PAIR

}  // namespace sdftrack::energies
