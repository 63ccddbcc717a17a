// SPDX-License-Identifier: MIT
// A frame's pixels on the GPU: one stream, its buffers, and the volumes that were sent to the device. No CUDA
// header is needed to include this; only builds with SDFTRACK_CUDA define it.
#pragma once

#include <memory>

#include "base/device_names.h"
#include "energies/color_field.h"
#include "energies/pixel_set.h"

namespace sdftrack::energies {

class CudaWork {
 public:
  explicit CudaWork(int device = 0);  // throws CudaError if the device does not respond
  ~CudaWork();
  CudaWork(const CudaWork&) = delete;
  CudaWork& operator=(const CudaWork&) = delete;

  // Copies the pixels to the device; the view is valid until the next upload.
  PixelsView<float> upload(const PixelSet& pixels);
  PixelsView<float> make_room(int count);
  // Brings the hits and classes of the uploaded pixels back.
  void download(PixelSet* pixels);
  // The volume with its values on the device. A volume with an id is sent once; the least recently used ones
  // make room for others. One without an id is sent by each call, unless it is there already
  // (device_copies.h).
  SdfView volume(const SdfView& sdf);
  // The colours of a volume that has an id, kept on the device in the same way.
  ColorView colors(const SdfView& sdf, const ColorView& colors);
  // From now on `count` volumes are in use at once: none of them makes room for another.
  void keep_volumes(std::size_t count);

  // Throws logic_error if the device holds another number of pixels.
  void check_uploaded(const PixelSet& pixels) const;

  // Work that others queue on it runs after the transfers of the volumes.
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
