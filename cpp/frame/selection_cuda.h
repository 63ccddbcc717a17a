// SPDX-License-Identifier: MIT
// The choice of pixels on the GPU, of many objects in one frame: the pixels never come to the host. No CUDA
// header is needed to include this; only builds with SDFTRACK_CUDA define it.
#pragma once

#include <vector>

#include "energies/cuda_work.h"
#include "frame/selection.h"

namespace sdftrack::frame {

// Pixels of a CudaWork, object after object.
struct PixelsOnDevice {
  energies::PixelsView<float> all;
  const int* counts;             // on the device, for each object
  std::vector<int> first, room;  // the object's slots in `all`

  // The slots of object k, of which counts[k] are used.
  energies::PixelsView<float> of(std::size_t k) const {
    const int f = first[k];
    return {room[k],           all.u_px + f,  all.v_px + f, all.depth_m + f,
            all.per_noise + f, all.hit_m + f, all.gain + f, all.foreground + f};
  }
};

// For each lookout, the same pixels as PixelSelection would pack. They replace what was uploaded before.
PixelsOnDevice choose_on_device(energies::CudaWork* work, const DepthFrame& frame,
                                const std::vector<Lookout>& lookouts, int requested);

}  // namespace sdftrack::frame
