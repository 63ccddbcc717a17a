// SPDX-License-Identifier: MIT
// A frame's pixels on the GPU: one stream, its buffers, and the volumes that were sent there. No CUDA header
// is needed to include this; only builds with SDFTRACK_CUDA define it.
#pragma once

#include <memory>

#include "base/device_names.h"
#include "energies/color_field.h"
#include "energies/pixel_set.h"

namespace sdftrack::energies {

class CudaWork {
 public:
  explicit CudaWork(int device = 0);  // CudaError where it does not answer
  ~CudaWork();
  CudaWork(const CudaWork&) = delete;
  CudaWork& operator=(const CudaWork&) = delete;

  // Copies the pixels there; the view is valid until the next upload.
  PixelsView<float> upload(const PixelSet& pixels);
  // The same number of pixels for kernels to fill, in place of what was uploaded.
  PixelsView<float> make_room(int count);
  // Brings the hits and classes of the uploaded pixels back.
  void download(PixelSet* pixels);
  // The volume with its values on the device. One with an id is sent once; those not used for the longest
  // time make room for others. One without is sent anew by each call, unless the device has the same values
  // already (device_copies.h).
  SdfView volume(const SdfView& sdf);
  // The colours beside a volume that has an id, likewise.
  ColorView colors(const SdfView& sdf, const ColorView& colors);
  // So many are in use at once from now on: none of them makes room for another.
  void keep_volumes(std::size_t count);

  // logic_error where the device holds another number of pixels.
  void check_uploaded(const PixelSet& pixels) const;

  // What others queue there finds the volumes that were sent before.
  const DeviceStream& stream() const;
  int device() const;

  struct Impl;
  Impl& impl() { return *impl_; }

 private:
  std::unique_ptr<Impl> impl_;
};

// The loops of term_ops.h for pixels and volumes that lie on the device, for each pair of compiled.inc.
template <class Field, class Penalty>
struct CudaOps {
  using Loop = Term<Field, Penalty>;
  static Sums<double, Field::P> linearize(CudaWork* work, const Loop& term);
  static double cost(CudaWork* work, const Loop& term);
  static void settle(CudaWork* work, const Loop& term, int steps);
};

}  // namespace sdftrack::energies
