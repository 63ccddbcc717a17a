// SPDX-License-Identifier: MIT
// Memory of superpixels on a GPU, and the ways to and from it. The caller's arrays are read and written by
// the host alone: they may change, or go, when the call has ended.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <vector>

#include "base/device_stream.h"
#include "superpixels/slic_planes.cuh"

namespace sdftrack::superpixels {

// Arrays of the host that are sent as one, through pinned memory, piece by piece where they are large.
class SlicInputs {
 public:
  static constexpr std::size_t kPiece = std::size_t{16} << 20, kAlign = 16;

  explicit SlicInputs(std::size_t piece = kPiece) : piece_(piece) {}  // a multiple of kAlign

  // Where in the device's memory it will be.
  template <class T>
  std::size_t add(const T* host, std::size_t n) {
    const std::size_t at = (end_ + kAlign - 1) / kAlign * kAlign;
    parts_.push_back({reinterpret_cast<const std::byte*>(host), at, n * sizeof(T)});
    end_ = at + n * sizeof(T);
    return at;
  }
  template <class T>
  std::size_t add(const std::vector<T>& host) {
    return add(host.data(), host.size());
  }
  std::size_t bytes() const { return end_; }

  // `piece`: pinned, for a piece's bytes or all, whichever is less; in use until the stream has come this
  // far.
  void send(const DeviceStream& stream, std::byte* piece, std::byte* device) const {
    std::size_t begin = 0;  // of the piece
    for (const Part& part : parts_)
      for (std::size_t done = 0; done < part.bytes;) {
        if (part.at + done == begin + piece_ || part.at >= begin + piece_) {
          stream.upload(piece, piece_, device + begin);
          stream.wait();
          begin += piece_;
        }
        const std::size_t to = part.at + done - begin, some = std::min(part.bytes - done, piece_ - to);
        std::memcpy(piece + to, part.host + done, some);
        done += some;
      }
    stream.upload(piece, end_ - begin, device + begin);
  }

 private:
  struct Part {
    const std::byte* host;
    std::size_t at, bytes;
  };
  std::size_t piece_;
  std::vector<Part> parts_;
  std::size_t end_ = 0;
};

// Buffers that are kept from call to call, as large as the largest has asked for.
struct SlicMemory {
  DeviceStream stream;
  PinnedBuffer<std::byte> pinned;
  PinnedBuffer<SlicCounters> counters_host{1};
  DeviceBuffer<std::byte> inputs;
  DeviceBuffer<int> c01, c2x, center, parent, size, labels, block_count, number;
  DeviceBuffer<Word> best, sums;
  DeviceBuffer<Center> centers;
  DeviceBuffer<SlicCounters> counters{1};

  // Before anything is on its way: growing would free what the stream still reads.
  void send(const SlicInputs& given, std::size_t pixels) {
    pinned.room(std::min(std::max(given.bytes(), pixels * sizeof(int)), SlicInputs::kPiece));
    given.send(stream, pinned.data(), inputs.room(given.bytes()));
  }
  // The counters and, unless they stay there, the labels, after all that the stream holds.
  const SlicCounters& fetch(std::size_t pixels, int* to) {
    const std::size_t most = SlicInputs::kPiece / sizeof(int);
    int* const piece = reinterpret_cast<int*>(pinned.data());
    stream.download(counters.data(), 1, counters_host.data());
    if (!to) stream.wait();
    for (std::size_t done = 0; to && done < pixels; done += most) {
      const std::size_t some = std::min(most, pixels - done);
      stream.download(labels.data() + done, some, piece);
      // Meanwhile the pages of new memory are made.
      constexpr std::size_t kPage = 4096 / sizeof(int);
      for (std::size_t k = 0; k < some; k += kPage) to[done + k] = 0;
      stream.wait();
      std::memcpy(to + done, piece, some * sizeof(int));
    }
    return *counters_host.data();
  }
};

}  // namespace sdftrack::superpixels
