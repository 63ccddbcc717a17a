// SPDX-License-Identifier: MIT
// Memory of superpixels on a GPU, and the transfers to and from it. Only the host reads and writes the
// caller's arrays: they may change, or be freed, once the call has ended.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstring>
#include <vector>

#include "base/device_stream.h"
#include "superpixels/slic_planes.cuh"

namespace sdftrack::superpixels {

// Arrays of the host that are sent as one, through pinned memory, in pieces if they are large.
class SlicInputs {
 public:
  static constexpr std::size_t kPiece = std::size_t{16} << 20, kPart = std::size_t{256} << 10, kAlign = 16;

  // part: bytes of a piece in transfer while the host copies the next ones. Multiples of kAlign.
  explicit SlicInputs(std::size_t piece = kPiece, std::size_t part = kPart) : piece_(piece), part_(part) {}

  // Returns its offset in the device's memory.
  template <class T>
  std::size_t add(const T* host, std::size_t n) {
    const std::size_t at = (end_ + kAlign - 1) / kAlign * kAlign;
    arrays_.push_back({reinterpret_cast<const std::byte*>(host), at, n * sizeof(T)});
    end_ = at + n * sizeof(T);
    return at;
  }
  template <class T>
  std::size_t add(const std::vector<T>& host) {
    return add(host.data(), host.size());
  }
  std::size_t bytes() const { return end_; }

  // `piece`: pinned, for a piece's bytes; in use until the stream has passed this point.
  void send(const DeviceStream& stream, std::byte* piece, std::byte* device) const {
    std::size_t begin = 0, sent = 0;  // start of the piece, and how much of it is in transfer
    const auto send_to = [&](std::size_t end) {
      stream.upload(piece + sent, end - sent, device + begin + sent);
      sent = end;
    };
    for (const Array& array : arrays_)
      for (std::size_t done = 0; done < array.bytes;) {
        if (array.at + done >= begin + piece_) {
          send_to(piece_);
          stream.wait();
          begin += piece_, sent = 0;
        }
        const std::size_t to = array.at + done - begin,
                          some = std::min({array.bytes - done, piece_ - to, part_});
        std::memcpy(piece + to, array.host + done, some);
        done += some;
        if (to + some >= sent + part_) send_to(to + some);
      }
    send_to(end_ - begin);
  }

 private:
  struct Array {
    const std::byte* host;
    std::size_t at, bytes;
  };
  std::size_t piece_, part_;
  std::vector<Array> arrays_;
  std::size_t end_ = 0;
};

// Buffers that are kept from call to call, as large as the largest request.
struct SlicMemory {
  static constexpr std::size_t kParts = 4;  // of the labels: the host copies one while the next is sent
  DeviceStream stream;
  PinnedBuffer<std::byte> pinned;
  PinnedBuffer<SlicCounters> counters_host{1};
  DeviceEvent arrived[kParts];
  DeviceBuffer<std::byte> inputs;
  DeviceBuffer<int> c01, c2x, center, parent, size, labels, block_count, number;
  DeviceBuffer<Word> best, sums;
  DeviceBuffer<Center> centers;
  DeviceBuffer<SlicCounters> counters{1};

  // Must run before any transfer: growing would free memory that the stream still reads.
  void send(const SlicInputs& given, std::size_t pixels) {
    pinned.room(std::min(std::max(given.bytes(), pixels * sizeof(int)), SlicInputs::kPiece));
    given.send(stream, pinned.data(), inputs.room(given.bytes()));
  }
  // The counters and, unless they stay on the device, the labels, after all work queued in the stream.
  const SlicCounters& fetch(std::size_t pixels, int* to) {
    const std::size_t most = SlicInputs::kPiece / sizeof(int);
    int* const piece = reinterpret_cast<int*>(pinned.data());
    stream.download(counters.data(), 1, counters_host.data());
    if (!to) stream.wait();
    for (std::size_t done = 0; to && done < pixels; done += most) {
      const std::size_t some = std::min(most, pixels - done);
      const std::size_t part = (some + kParts - 1) / kParts;
      const auto each_part = [&](const auto& work) {
        for (std::size_t k = 0, at = 0; at < some; ++k, at += part)
          work(arrived[k], at, std::min(part, some - at));
      };
      each_part([&](const DeviceEvent& event, std::size_t at, std::size_t n) {
        stream.download(labels.data() + done + at, n, piece + at);
        event.record(stream);
      });
      // Meanwhile, touching each page maps new memory.
      constexpr std::size_t kPage = 4096 / sizeof(int);
      for (std::size_t k = 0; k < some; k += kPage) to[done + k] = 0;
      each_part([&](const DeviceEvent& event, std::size_t at, std::size_t n) {
        event.wait();
        std::memcpy(to + done + at, piece + at, n * sizeof(int));
      });
    }
    return *counters_host.data();
  }
};

}  // namespace sdftrack::superpixels
