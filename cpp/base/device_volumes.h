// SPDX-License-Identifier: MIT
// The volumes that were sent to a GPU. Only builds with SDFTRACK_CUDA include this file.
#pragma once

#include <algorithm>
#include <cstdint>
#include <list>

#include "base/device_stream.h"
#include "base/views.h"

namespace sdftrack {

// A volume with an id is sent once. At most `most` are kept; the least recently used ones make room for
// others. A volume without an id is sent by each call. Works on the device that is current at the call.
class DeviceVolumes {
 public:
  explicit DeviceVolumes(std::size_t most) : most_(most) {}

  // Keeps at least `count` volumes from now on.
  void keep(std::size_t count) { most_ = std::max(most_, count); }

  // Starts a frame: no volume of the last frame is still in use.
  void begin_frame() {
    ++frame_;
    sent_.remove_if([](const Sent& v) { return v.id == 0; });
  }

  // The volume with its values on the device, for work queued later on the stream.
  SdfView send(const SdfView& sdf, const DeviceStream& stream) {
    const auto known = std::find_if(sent_.begin(), sent_.end(),
                                    [&](const Sent& v) { return sdf.id != 0 && v.id == sdf.id; });
    if (known != sent_.end()) {
      sent_.splice(sent_.begin(), sent_, known);
    } else {
      const std::size_t voxels = std::size_t(sdf.nx) * sdf.ny * sdf.nz;
      Sent made{sdf.id, 0, room_for(voxels)};
      stream.upload(sdf.phi, voxels, made.phi.data());
      stream.wait();  // the caller may change or free the values
      sent_.push_front(std::move(made));
    }
    sent_.front().frame = frame_;
    SdfView view = sdf;
    view.phi = sent_.front().phi.data();
    return view;
  }

 private:
  struct Sent {
    std::uint64_t id, frame;  // frame: that of the last use
    DeviceBuffer<float> phi;
  };

  // If the device is full, frees volumes that this frame has not used.
  DeviceBuffer<float> room_for(std::size_t voxels) {
    while (sent_.size() >= most_) sent_.pop_back();
    try {
      return DeviceBuffer<float>(voxels);
    } catch (const CudaError&) {
      sent_.remove_if([this](const Sent& v) { return v.frame != frame_; });
      return DeviceBuffer<float>(voxels);
    }
  }

  std::size_t most_;
  std::uint64_t frame_ = 0;
  std::list<Sent> sent_;  // the most recently used first
};

}  // namespace sdftrack
