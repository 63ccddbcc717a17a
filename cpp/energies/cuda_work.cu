// SPDX-License-Identifier: MIT
#include <algorithm>
#include <stdexcept>

#include "base/device_volumes.h"
#include "energies/cuda_work.h"
#include "energies/reduce_cuda.cuh"

namespace sdftrack::energies {

namespace {

constexpr int kMaxSummed = kSummed<Four::P>;
constexpr int kColumns = 7;  // u, v, depth, 1 / noise, foreground, hit, gain
constexpr std::size_t kMostVolumes = 128;

}  // namespace

// The pixels are one block of memory, column after column, so that one copy brings them there.
struct CudaWork::Impl {
  explicit Impl(int device_) : device(device_) {}

  int device;
  DeviceStream stream;
  int count = 0;  // pixels
  DeviceBuffer<float> pixels;
  PinnedBuffer<float> staging;
  DeviceBuffer<double> partial{static_cast<std::size_t>(kMaxBlocks) * kMaxSummed}, total{kMaxSummed};
  PinnedBuffer<double> sums{kMaxSummed};
  DeviceVolumes volumes{kMostVolumes};

  float* column(int k) { return pixels.data() + static_cast<std::ptrdiff_t>(k) * count; }

  // The first n totals on the host, once the stream has come to them.
  const double* finish(int blocks, int n) {
    launch(stream, 1, AddBlocks{partial.data(), blocks, n, total.data()});
    stream.download(total.data(), static_cast<std::size_t>(n), sums.data());
    stream.wait();
    return sums.data();
  }
};

namespace {

// The members belong to the device, whatever the caller's current one is.
std::unique_ptr<CudaWork::Impl> make_impl(int device) {
  const DeviceScope scope(device);
  return std::make_unique<CudaWork::Impl>(device);
}

}  // namespace

CudaWork::CudaWork(int device) : impl_(make_impl(device)) {}
CudaWork::~CudaWork() = default;
const DeviceStream& CudaWork::stream() const { return impl_->stream; }
int CudaWork::device() const { return impl_->device; }

PixelsView<float> CudaWork::upload(const PixelSet& set) {
  Impl& w = *impl_;
  const DeviceScope scope(w.device);
  w.stream.wait();  // the last copy may still read the staging buffer
  w.volumes.begin_frame();
  w.count = 0;  // until all of it is there
  const auto n = static_cast<std::size_t>(set.count()), room = (n + n / 2) * kColumns;
  if (w.pixels.size() < n * kColumns) w.pixels.room(room);
  if (w.staging.size() < n * kColumns) w.staging.room(room);
  const std::vector<float>* const columns[kColumns] = {
      &set.u_px, &set.v_px, &set.depth_m, &set.per_noise, &set.foreground, &set.hit_m, &set.gain};
  for (std::size_t k = 0; k < kColumns; ++k) std::copy_n(columns[k]->data(), n, w.staging.data() + k * n);
  w.stream.upload(w.staging.data(), n * kColumns, w.pixels.data());
  w.count = set.count();
  return {w.count, w.column(0), w.column(1), w.column(2), w.column(3), w.column(5), w.column(6), w.column(4)};
}

void CudaWork::download(PixelSet* set) {
  Impl& w = *impl_;
  const DeviceScope scope(w.device);
  const auto n = static_cast<std::size_t>(w.count);
  if (set->count() != w.count) throw std::logic_error("CudaWork: other pixels than were uploaded");
  w.stream.download(w.column(5), 2 * n, w.staging.data());  // hits and gains lie side by side
  w.stream.wait();
  std::copy_n(w.staging.data(), n, set->hit_m.data());
  std::copy_n(w.staging.data() + n, n, set->gain.data());
}

SdfView CudaWork::volume(const SdfView& sdf) {
  const DeviceScope scope(impl_->device);
  return impl_->volumes.send(sdf, impl_->stream);
}

template <class Field, class Penalty>
Sums<double, Field::P> CudaOps<Field, Penalty>::linearize(CudaWork* work, const Loop& term) {
  constexpr int P = Field::P;
  Sums<double, P> out;
  if (term.pixels.count == 0) return out;
  CudaWork::Impl& w = work->impl();
  const DeviceScope scope(w.device);
  const int blocks = blocks_for(term.pixels.count);
  launch(w.stream, static_cast<unsigned>(blocks), LinearizeOf<Loop>{term, w.partial.data()});
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
  const DeviceScope scope(w.device);
  const int blocks = blocks_for(term.pixels.count);
  launch(w.stream, static_cast<unsigned>(blocks), Cost<Loop>{term, w.partial.data()});
  return w.finish(blocks, 1)[0];
}

template <class Field, class Penalty>
void CudaOps<Field, Penalty>::settle(CudaWork* work, const Loop& term, int steps) {
  if (term.pixels.count == 0 || steps <= 0) return;
  CudaWork::Impl& w = work->impl();
  const DeviceScope scope(w.device);
  launch(w.stream, static_cast<unsigned>(blocks_for(term.pixels.count)), Settle<Loop>{term, steps});
}

#define SDFTRACK_PAIR(name, field, penalty) template struct CudaOps<field, penalty>;
#include "energies/compiled.inc"
#undef SDFTRACK_PAIR

}  // namespace sdftrack::energies
