// SPDX-License-Identifier: MIT
// The members of a volume on a GPU (device_volume.h). Only .cu files include this.
#pragma once

#include <algorithm>

#include "levelset/device_blocks.cuh"
#include "levelset/device_frame.cuh"
#include "levelset/device_volume.h"

namespace sdftrack::levelset {

constexpr int kLists = 8;
constexpr int kMostListed = 1056;  // blocks of threads: eight per multiprocessor of a large GPU

struct DeviceVolume::Impl {
  // The data that the host reads after a frame.
  struct Report {
    double change_m;
    int has_surface, nodes_changed;
    int listed[kLists];
  };

  Impl(EvidenceVolume* evidence, int device);
  ~Impl();

  DeviceVoxels of_voxels() { return {log_ratio.data(), weight.data(), phi.data(), colors.data()}; }
  DeviceBlocks of_blocks() {
    unsigned char* const b = bytes.data();
    const std::size_t n = count;
    return {b,         b + n,     b + 2 * n, b + 3 * n,    b + 4 * n,    b + 5 * n,
            b + 6 * n, b + 7 * n, b + 8 * n, shown.data(), moved.data(), change.data()};
  }
  // The k-th list, at most `count` long.
  BlockList list(int k) { return {lists.data() + std::size_t(k) * count, report.data()->listed + k}; }
  template <class Rule>
  void make_lists(const Rule& rule, unsigned how_many = 1) {
    launch(stream, how_many, ListBlocks<Rule>{rule, blocks.count(), list(0)});
  }
  unsigned for_each_block() const { return blocks_of(blocks.count(), kThreadsPerBlocks); }
  unsigned for_listed() const { return static_cast<unsigned>(std::min(blocks.count(), kMostListed)); }
  // Sends what is missing in the host's copy, which may be read after the wait.
  void show(int what);
  void wait_for_what_is_shown();
  const Report& read_report() {
    stream.download(report.data(), 1, host_report.data());
    stream.wait();
    return *host_report.data();
  }

  int device;
  DeviceStream stream;
  BlockLattice blocks;
  std::size_t voxels, count;
  DeviceBuffer<float> log_ratio, weight, phi;
  DeviceBuffer<VoxelColor> colors;
  DeviceBuffer<unsigned char> bytes;
  DeviceBuffer<int> shown;
  DeviceBuffer<float> moved;
  DeviceBuffer<SurfaceChange> change;
  DeviceBuffer<int> lists;
  DeviceBuffer<float> nodes, other_nodes;
  DeviceBuffer<unsigned char> known;
  DeviceBuffer<Report> report;
  DeviceFrame readings;
  int frame = 0;

  // Host memory, to which the device writes its results and its changes of the volume.
  PinnedBuffer<Report> host_report;
  PinnedBuffer<unsigned char> surface;
  PinnedBuffer<float> phi_here;
  PinnedBuffer<VoxelColor> colors_here;
  std::vector<unsigned char> surface_here;
  double change_m = 0;
  int older = 0;            // Shown: what may have changed since it was last sent to the host
  bool on_its_way = false;  // whether the sent data may still be written
};

}  // namespace sdftrack::levelset
