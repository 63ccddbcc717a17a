// SPDX-License-Identifier: MIT
// What a build without CUDA has in place of cuda_work.cu: one error.
#include <stdexcept>

#include "energies/cuda_work.h"

namespace sdftrack::energies {

namespace {

[[noreturn]] void fail() { throw std::runtime_error("this build of sdftrack has no CUDA path"); }

}  // namespace

struct CudaWork::Impl {};

CudaWork::CudaWork() { fail(); }
CudaWork::~CudaWork() = default;
PixelsView<float> CudaWork::upload(const PixelSet&) { fail(); }
void CudaWork::download(PixelSet*) { fail(); }
SdfView CudaWork::volume(const SdfView&) { fail(); }

template <class Field, class Penalty>
Sums<double, Field::P> CudaOps<Field, Penalty>::linearize(CudaWork*, const Loop&) {
  fail();
}
template <class Field, class Penalty>
double CudaOps<Field, Penalty>::cost(CudaWork*, const Loop&) {
  fail();
}
template <class Field, class Penalty>
void CudaOps<Field, Penalty>::settle(CudaWork*, const Loop&, int) {
  fail();
}
#define SDFTRACK_PAIR(name, field, penalty) template struct CudaOps<field, penalty>;
#include "energies/compiled.inc"
#undef SDFTRACK_PAIR

}  // namespace sdftrack::energies
