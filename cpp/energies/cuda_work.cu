// SPDX-License-Identifier: MIT
#include <algorithm>
#include <map>
#include <stdexcept>

#include "base/device_buffer.h"
#include "base/device_stream.h"
#include "energies/cuda_work.h"
#include "energies/reduce_cuda.cuh"

namespace sdftrack::energies {

namespace {

constexpr int kMaxSummed = kSummed<Four::P>;
constexpr int kColumns = 7;  // u, v, depth, 1 / noise, foreground, hit, gain

}  // namespace

// The pixels are one block of memory, column after column, so that one copy brings them there.
struct CudaWork::Impl {
  DeviceStream stream;
  int room = 0, count = 0;  // pixels
  DeviceBuffer<float> pixels;
  PinnedBuffer<float> staging;
  DeviceBuffer<double> partial{static_cast<std::size_t>(kMaxBlocks) * kMaxSummed}, total{kMaxSummed};
  PinnedBuffer<double> sums{kMaxSummed};
  std::map<const float*, DeviceBuffer<float>> volumes;

  void make_room(int n) {
    if (n <= room) return;
    room = n + n / 2;
    pixels = DeviceBuffer<float>(static_cast<std::size_t>(room) * kColumns);
    staging = PinnedBuffer<float>(static_cast<std::size_t>(room) * kColumns);
  }
  float* column(int k) { return pixels.data() + static_cast<std::ptrdiff_t>(k) * count; }

  // The first n totals on the host, once the stream has come to them.
  const double* finish(int blocks, int n) {
    add_blocks_kernel<<<1, kBlockThreads, 0, stream.get()>>>(partial.data(), blocks, n, total.data());
    SDFTRACK_CHECK_CUDA(cudaGetLastError());
    stream.download(total.data(), static_cast<std::size_t>(n), sums.data());
    stream.wait();
    return sums.data();
  }
};

CudaWork::CudaWork() : impl_(std::make_unique<Impl>()) {}
CudaWork::~CudaWork() = default;

PixelsView<float> CudaWork::upload(const PixelSet& set) {
  Impl& w = *impl_;
  w.stream.wait();  // the last copy may still read the staging buffer
  w.make_room(set.count());
  w.count = set.count();
  const auto n = static_cast<std::size_t>(w.count);
  const std::vector<float>* const columns[kColumns] = {
      &set.u_px, &set.v_px, &set.depth_m, &set.per_noise, &set.foreground, &set.hit_m, &set.gain};
  for (std::size_t k = 0; k < kColumns; ++k) std::copy_n(columns[k]->data(), n, w.staging.data() + k * n);
  w.stream.upload(w.staging.data(), n * kColumns, w.pixels.data());
  return {w.count, w.column(0), w.column(1), w.column(2), w.column(3), w.column(5), w.column(6), w.column(4)};
}

void CudaWork::download(PixelSet* set) {
  Impl& w = *impl_;
  const auto n = static_cast<std::size_t>(w.count);
  if (set->count() != w.count) throw std::logic_error("CudaWork: other pixels than were uploaded");
  w.stream.download(w.column(5), 2 * n, w.staging.data());  // hits and gains lie side by side
  w.stream.wait();
  std::copy_n(w.staging.data(), n, set->hit_m.data());
  std::copy_n(w.staging.data() + n, n, set->gain.data());
}

SdfView CudaWork::volume(const SdfView& sdf) {
  DeviceBuffer<float>& there = impl_->volumes[sdf.phi];
  const std::size_t voxels =
      static_cast<std::size_t>(sdf.nx) * static_cast<std::size_t>(sdf.ny) * static_cast<std::size_t>(sdf.nz);
  if (there.size() != voxels) {
    there = DeviceBuffer<float>(voxels);
    there.upload(sdf.phi, voxels);
  }
  SdfView view = sdf;
  view.phi = there.data();
  return view;
}

template <class Field, class Penalty>
Sums<double, Field::P> CudaOps<Field, Penalty>::linearize(CudaWork* work, const Loop& term) {
  constexpr int P = Field::P;
  Sums<double, P> out;
  if (term.pixels.count == 0) return out;
  CudaWork::Impl& w = work->impl();
  const int blocks = blocks_for(term.pixels.count);
  linearize_kernel<<<blocks, kBlockThreads, 0, w.stream.get()>>>(term, w.partial.data());
  SDFTRACK_CHECK_CUDA(cudaGetLastError());
  const double* const sums = w.finish(blocks, kSummed<P>);
  out.cost = sums[0], out.count = term.pixels.count;
  std::copy_n(sums + 1, P, out.gradient);
  std::copy_n(sums + 1 + P, P * (P + 1) / 2, out.hessian);
  return out;
}

template <class Field, class Penalty>
double CudaOps<Field, Penalty>::cost(CudaWork* work, const Loop& term) {
  if (term.pixels.count == 0) return 0;
  CudaWork::Impl& w = work->impl();
  const int blocks = blocks_for(term.pixels.count);
  cost_kernel<<<blocks, kBlockThreads, 0, w.stream.get()>>>(term, w.partial.data());
  SDFTRACK_CHECK_CUDA(cudaGetLastError());
  return w.finish(blocks, 1)[0];
}

template <class Field, class Penalty>
void CudaOps<Field, Penalty>::settle(CudaWork* work, const Loop& term, int steps) {
  if (term.pixels.count == 0 || steps <= 0) return;
  settle_kernel<<<blocks_for(term.pixels.count), kBlockThreads, 0, work->impl().stream.get()>>>(term, steps);
  SDFTRACK_CHECK_CUDA(cudaGetLastError());
}

#define SDFTRACK_PAIR(name, field, penalty) template struct CudaOps<field, penalty>;
#include "energies/compiled.inc"
#undef SDFTRACK_PAIR

}  // namespace sdftrack::energies
