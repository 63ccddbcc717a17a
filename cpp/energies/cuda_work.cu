// SPDX-License-Identifier: MIT
#include <stdexcept>

#include "base/device_copies.h"
#include "energies/cuda_work.cuh"

namespace sdftrack::energies {

namespace {

// Creates the members on `device`, whatever the caller's current device is.
std::unique_ptr<CudaWork::Impl> make_impl(int device) {
  const DeviceScope scope(device);
  return std::make_unique<CudaWork::Impl>(device);
}

}  // namespace

CudaWork::CudaWork(int device) : impl_(make_impl(device)) {}
CudaWork::~CudaWork() = default;
const DeviceStream& CudaWork::stream() const { return impl_->stream; }
int CudaWork::device() const { return impl_->device; }

PixelsView<float> CudaWork::make_room(int count) {
  Impl& w = *impl_;
  const DeviceScope scope(w.device);
  w.volumes.begin_frame(), w.colors.begin_frame();
  w.count = 0;  // until the memory is allocated
  const auto n = std::size_t(count);
  if (w.pixels.size() < n * kColumns) w.pixels.room((n + n / 2) * kColumns);
  w.count = count;
  return w.view();
}

PixelsView<float> CudaWork::upload(const PixelSet& set) {
  Impl& w = *impl_;
  const DeviceScope scope(w.device);
  w.take_turn(Impl::kStaging);
  const PixelsView<float> view = make_room(set.count());
  w.count = 0;  // until all data is copied
  const auto n = std::size_t(set.count());
  if (w.staging.size() < n * kColumns) w.staging.room((n + n / 2) * kColumns);
  const std::vector<float>* const columns[kColumns] = {
      &set.u_px, &set.v_px, &set.depth_m, &set.per_noise, &set.foreground, &set.hit_m, &set.gain};
  for (std::size_t k = 0; k < kColumns; ++k) std::copy_n(columns[k]->data(), n, w.staging.data() + k * n);
  w.stream.upload(w.staging.data(), n * kColumns, w.pixels.data());
  w.count = set.count();
  return view;
}

void CudaWork::download(PixelSet* set) {
  Impl& w = *impl_;
  const DeviceScope scope(w.device);
  check_uploaded(*set);
  w.queue_hits();
  w.wait();
  w.take_hits(set);
}

void CudaWork::check_uploaded(const PixelSet& set) const {
  if (set.count() != impl_->count) throw std::logic_error("CudaWork: other pixels than were uploaded");
}

void CudaWork::keep_volumes(std::size_t count) { impl_->volumes.keep(count), impl_->colors.keep(count); }

SdfView CudaWork::volume(const SdfView& sdf) {
  Impl& w = *impl_;
  SdfView view = sdf;
  view.phi = DeviceCopies::find(sdf.phi, w.device);
  if (view.phi) return view;
  const DeviceScope scope(w.device);
  return w.volumes.send(sdf, w.stream);
}

// Sends the colours as a volume with two floats in place of each voxel's one.
ColorView CudaWork::colors(const SdfView& sdf, const ColorView& colors) {
  static_assert(4 * sizeof(*colors.rgb_seen) == 2 * sizeof(float));
  Impl& w = *impl_;
  ColorView there = colors;
  there.rgb_seen = DeviceCopies::find(colors.rgb_seen, w.device);
  if (there.rgb_seen) return there;
  const DeviceScope scope(w.device);
  SdfView wide = sdf;
  wide.phi = reinterpret_cast<const float*>(colors.rgb_seen), wide.nx = 2 * sdf.nx;
  there.rgb_seen = reinterpret_cast<const std::uint16_t*>(w.colors.send(wide, w.stream).phi);
  return there;
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
