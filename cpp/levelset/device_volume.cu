// SPDX-License-Identifier: MIT
#include <algorithm>
#include <string>

#include "base/device_copies.h"
#include "base/parallel.h"
#include "levelset/device_volume.h"
#include "levelset/distance_kernels.cuh"
#include "levelset/evidence_kernels.cuh"
#include "levelset/volume_kernels.cuh"

namespace sdftrack::levelset {

namespace {

constexpr int kLists = 8,
              kMostListed = 1056;           // blocks of threads: eight for each multiprocessor of a large GPU
constexpr int kSweepsAtOnce = 16;           // until the host looks whether it is done; an even number
constexpr std::size_t kShownAtOnce = 2048;  // blocks
constexpr std::size_t kAlign = 256;

std::size_t aligned(std::size_t bytes) { return (bytes + kAlign - 1) / kAlign * kAlign; }

// What the host reads after a frame.
struct Report {
  double change_m;
  int has_surface, nodes_changed;
  int listed[kLists];
};

}  // namespace

struct DeviceVolume::Impl {
  Impl(EvidenceVolume* evidence, int device_)
      : device(device_),
        blocks(evidence->blocks()),
        voxels(blocks.grid.size()),
        count(static_cast<std::size_t>(blocks.count())),
        log_ratio(voxels),
        weight(voxels),
        phi(voxels),
        colors(voxels),
        bytes(9 * count),
        shown(count),
        moved(count),
        change(count),
        lists(kLists * count),
        nodes(coarse_lattice(blocks.grid).size()),
        other_nodes(nodes.size()),
        known(nodes.size()),
        report(1),
        host_report(1),
        surface(count),
        phi_here(voxels) {
    const EvidenceVolume::Parts from = evidence->parts();
    frame = *from.frame;
    // What is uploaded is pageable memory of the caller's, of which a copy may still be read when this call
    // returns: hence the wait at the end.
    const StreamWaiter waiter(stream);
    stream.upload(from.log_ratio, voxels, log_ratio.data());
    stream.upload(from.weight, voxels, weight.data());
    stream.upload(from.colors, voxels, colors.data());
    stream.fill_zero(bytes.data(), bytes.size());
    const DeviceBlocks of = of_blocks();
    stream.upload(from.empty, count, of.empty);
    stream.upload(from.spoken, count, of.spoken);
    stream.upload(from.turned, count, of.turned);
    stream.fill_zero(shown.data(), count);
    stream.fill_zero(moved.data(), count);
    stream.fill_zero(change.data(), count);
    stream.fill_zero(report.data(), 1);
    launch(stream, blocks_of(static_cast<std::int64_t>(voxels), kThreadsPerVoxels),
           FillSides{log_ratio.data(), far_side_m(blocks.grid), voxels, phi.data()});
    stream.download(phi.data(), voxels, phi_here.data());
    stream.wait();
    DeviceCopies::add(phi_here.data(), device, phi.data());
  }
  ~Impl() {
    DeviceCopies::remove(phi_here.data(), device);
    static_cast<void>(cudaStreamSynchronize(stream.get()));
  }

  DeviceVoxels of_voxels() { return {log_ratio.data(), weight.data(), phi.data(), colors.data()}; }
  DeviceBlocks of_blocks() {
    unsigned char* const b = bytes.data();
    const std::size_t n = count;
    return {b,         b + n,     b + 2 * n, b + 3 * n,    b + 4 * n,    b + 5 * n,
            b + 6 * n, b + 7 * n, b + 8 * n, shown.data(), moved.data(), change.data()};
  }
  // The k-th list, `count` long at most.
  BlockList list(int k) {
    return {lists.data() + static_cast<std::size_t>(k) * count, report.data()->listed + k};
  }
  template <class Rule>
  void make_lists(const Rule& rule, unsigned how_many = 1) {
    launch(stream, how_many, ListBlocks<Rule>{rule, blocks.count(), list(0)});
  }
  unsigned for_each_block() const { return blocks_of(blocks.count(), kThreadsPerBlocks); }
  unsigned for_listed() const { return static_cast<unsigned>(std::min(blocks.count(), kMostListed)); }
  const Report& read_report() {
    stream.download(report.data(), 1, host_report.data());
    stream.wait();
    return *host_report.data();
  }

  // Copies that the stream makes from here are of pinned memory, which no one changes before it has waited.
  unsigned char* stage(std::size_t size) {
    stream.wait();
    if (staging.size() < size) staging.room(size + size / 2);
    if (staged.size() < size) staged.room(size + size / 2);
    return staging.data();
  }

  template <class T>
  void show_blocks(int which, std::size_t changed, const T* values, T* here, int threads);

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
  PinnedBuffer<Report> host_report;
  DeviceBuffer<unsigned char> staged;
  PinnedBuffer<unsigned char> staging, surface;
  LargeArray<float> phi_here;
  std::vector<unsigned char> surface_here;
  std::vector<Tile> tiles;
  double change_m = 0;
  int frame = 0;
  int filled_from = 0, filled_to = 0;  // layers of blocks that fill_far has gone through, not shown yet
};

DeviceVolume::DeviceVolume(EvidenceVolume* evidence, int device) {
  const DeviceScope scope(device);
  try {
    impl_ = std::make_unique<Impl>(evidence, device);
  } catch (const CudaError& error) {
    if (std::string(error.what()).find("cudaErrorMemoryAllocation") == std::string::npos) throw;
    const sdf::Grid& grid = evidence->grid();
    throw CudaError("CUDA: the device has too little free memory for a volume of " + std::to_string(grid.nx) +
                    " x " + std::to_string(grid.ny) + " x " + std::to_string(grid.nz) + " voxels (about " +
                    std::to_string(21 * grid.size() / 1000000) +
                    " MB); use fewer voxels, or device=\"cpu\" (" + error.what() + ")");
  }
}
DeviceVolume::~DeviceVolume() = default;

void DeviceVolume::fuse(const EvidenceImage& image, const FrameColors& colors, const Camera& camera,
                        const Rigidd& T_cam_obj, const EvidenceOptions& options) {
  Impl& v = *impl_;
  const DeviceScope scope(v.device);
  find_tiles(image, evidence_reach_m(options), &v.tiles);
  const std::size_t n = image.pixels().size(), pixels = aligned(n * sizeof(EvidencePixel)),
                    rgb = aligned(4 * n), tiles = v.tiles.size() * sizeof(Tile);
  unsigned char* const here = v.stage(pixels + rgb + tiles);
  std::copy_n(image.pixels().data(), n, reinterpret_cast<EvidencePixel*>(here));
  for (std::size_t i = 0; i < n; ++i) {
    const int source = image.source()[i];
    unsigned char* const to = here + pixels + 4 * i;
    to[0] = to[1] = to[2] = to[3] = 0;
    if (colors.rgb && source >= 0) std::copy_n(colors.rgb + 3 * static_cast<std::ptrdiff_t>(source), 3, to);
  }
  std::copy_n(v.tiles.data(), v.tiles.size(), reinterpret_cast<Tile*>(here + pixels + rgb));
  const unsigned char* const there = v.staged.data();
  v.stream.upload(here, pixels + rgb + tiles, v.staged.data());

  const BlockSight sight{v.blocks,
                         T_cam_obj,
                         camera.K,
                         image.rect().x0,
                         image.rect().y0,
                         tiles_along(image.width()),
                         tiles_along(image.height()),
                         reinterpret_cast<const Tile*>(there + pixels + rgb),
                         v.frame,
                         options.known_every};
  const DeviceBlocks of = v.of_blocks();
  launch(v.stream, v.for_each_block(), ChooseBlocks{sight, of});
  v.make_lists(IsMarked{of.marked});
  launch(v.stream, v.for_listed(),
         FuseBlocks{evidence_term(image, reinterpret_cast<const float*>(there), camera, options), sight,
                    v.of_voxels(), of, v.list(0), there + pixels, options.max_weight,
                    options.color_reach_voxels * static_cast<float>(v.blocks.grid.voxel_m)});
  ++v.frame;
}

void DeviceVolume::update(int rounds, float band_voxels, bool all) {
  Impl& v = *impl_;
  const DeviceScope scope(v.device);
  const auto voxel_m = static_cast<float>(v.blocks.grid.voxel_m);
  const float band_m = band_voxels * voxel_m;
  const DeviceBlocks of = v.of_blocks();
  launch(v.stream, v.for_each_block(), FindRoles{v.blocks, of, all});
  v.make_lists(HasRole{of.role});
  launch(v.stream, v.for_listed(), CrossBlocks{v.blocks, v.of_voxels(), of, v.list(0), voxel_m});
  launch(v.stream, 1, AddChanges{of, v.list(0), &v.report.data()->change_m});
  launch(v.stream, v.for_each_block(), FindSources{v.blocks.count(), of, kStays * voxel_m});
  launch(v.stream, v.for_each_block(), MarkBlocks{v.blocks, of});
  v.make_lists(MayBeNear{of.marked});
  launch(v.stream, v.for_listed(), FindNear{v.blocks, v.phi.data(), of, v.list(0), band_m});
  v.make_lists(FollowsInColor{v.blocks, of.marked}, kLists);
  // A front that has gone leaves distances behind that are too small: they grow by a voxel in each round.
  for (int round = 0; round < rounds; ++round)
    for (int color = 0; color < kLists; ++color)
      launch(v.stream, v.for_listed(),
             RelaxBlocks{v.blocks,
                         {voxel_m, kMax_m},
                         of,
                         v.list(color),
                         round % 2 == 0,
                         kSettled * voxel_m,
                         band_m,
                         v.phi.data()});
}

void DeviceVolume::sweep_far(float band_voxels) {
  Impl& v = *impl_;
  const DeviceScope scope(v.device);
  const sdf::Grid& grid = v.blocks.grid;
  const sdf::Grid lattice = coarse_lattice(grid);
  const float band_m = band_voxels * static_cast<float>(grid.voxel_m);
  const unsigned threads = blocks_of(static_cast<std::int64_t>(lattice.size()), kThreadsPerVoxels);
  float *from = v.nodes.data(), *to = v.other_nodes.data();
  Report* const report = v.report.data();
  v.stream.fill_zero(&report->has_surface, 1);
  launch(v.stream, threads,
         StartNodes{grid, lattice, v.phi.data(), band_m, from, to, v.known.data(), &report->has_surface});
  do {
    v.stream.fill_zero(&report->nodes_changed, 1);
    for (int k = 0; k < kSweepsAtOnce; ++k) {
      launch(v.stream, threads, SweepNodes{lattice, v.known.data(), from, to, &report->nodes_changed});
      std::swap(from, to);
    }
  } while (v.read_report().nodes_changed);
  launch(v.stream, threads, SignNodes{grid, lattice, v.phi.data(), from, to});
}

void DeviceVolume::fill_far(float band_voxels, int z0, int z1) {
  Impl& v = *impl_;
  if (z1 <= z0) return;
  const DeviceScope scope(v.device);
  const sdf::Grid& grid = v.blocks.grid;
  const std::size_t slice = static_cast<std::size_t>(grid.nx) * static_cast<std::size_t>(grid.ny),
                    first = slice * static_cast<std::size_t>(z0), last = slice * static_cast<std::size_t>(z1);
  launch(v.stream, blocks_of(static_cast<std::int64_t>(last - first), kThreadsPerVoxels),
         FillFar{grid, coarse_lattice(grid), v.other_nodes.data(), &v.report.data()->has_surface,
                 band_voxels * static_cast<float>(grid.voxel_m), first, last, v.phi.data()});
  const int from = z0 / kBlockSide, to = blocks_along(z1);
  const bool none = v.filled_from >= v.filled_to;
  v.filled_from = none ? from : std::min(from, v.filled_from);
  v.filled_to = none ? to : std::max(to, v.filled_to);
}

// List `which` of blocks, or the whole volume where most of it has changed.
template <class T>
void DeviceVolume::Impl::show_blocks(int which, std::size_t changed, const T* values, T* here, int threads) {
  if (2 * changed > count) {
    const StreamWaiter waiter(stream);
    stream.download(values, voxels, here);
    stream.wait();
    return;
  }
  for (std::size_t from = 0; from < changed; from += kShownAtOnce) {
    const std::size_t n = std::min(kShownAtOnce, changed - from);
    const std::size_t room = n * (kBlockVoxels * sizeof(T) + sizeof(int));
    const T* const values_here = reinterpret_cast<const T*>(stage(room));
    T* const values_there = reinterpret_cast<T*>(staged.data());
    const int* const ids = reinterpret_cast<const int*>(values_here + n * kBlockVoxels);
    const int* const listed = list(which).blocks + from;
    launch(stream, static_cast<unsigned>(n), Gather<T>{blocks, listed, values, values_there});
    stream.download(values_there, n * kBlockVoxels, const_cast<T*>(values_here));
    stream.download(listed, n, const_cast<int*>(ids));
    stream.wait();
    parallel_for(n, threads, [&](std::size_t k) {
      std::size_t first;
      const BlockRows rows = blocks.rows(ids[k], &first);
      for (int row = 0; row < rows.ny * rows.nz; ++row)
        std::copy_n(
            values_here + k * kBlockVoxels + kBlockSide * (row % rows.ny + kBlockSide * (row / rows.ny)),
            rows.nx, here + first + rows.offset(row));
    });
  }
}

void DeviceVolume::show(EvidenceVolume* evidence, int threads) {
  Impl& v = *impl_;
  const DeviceScope scope(v.device);
  const DeviceBlocks of = v.of_blocks();
  v.make_lists(NotShown{v.blocks, of.shown, v.filled_from, v.filled_to}, 2);
  v.stream.download(of.surface, v.count, v.surface.data());
  const Report report = v.read_report();
  v.surface_here.assign(v.surface.data(), v.surface.data() + v.count);
  v.change_m = report.change_m;
  v.show_blocks(0, static_cast<std::size_t>(report.listed[0]), v.phi.data(), v.phi_here.data(), threads);
  v.show_blocks(1, static_cast<std::size_t>(report.listed[1]), v.colors.data(), evidence->parts().colors,
                threads);
  v.stream.fill_zero(v.shown.data(), v.count);
  v.stream.wait();
  v.filled_from = v.filled_to = 0;
}

void DeviceVolume::download(EvidenceVolume* evidence) {
  Impl& v = *impl_;
  const DeviceScope scope(v.device);
  const EvidenceVolume::Parts to = evidence->parts();
  const DeviceBlocks of = v.of_blocks();
  const StreamWaiter waiter(v.stream);
  v.stream.download(v.log_ratio.data(), v.voxels, to.log_ratio);
  v.stream.download(v.weight.data(), v.voxels, to.weight);
  v.stream.download(v.colors.data(), v.voxels, to.colors);
  v.stream.download(of.empty, v.count, to.empty);
  v.stream.download(of.spoken, v.count, to.spoken);
  v.stream.download(of.turned, v.count, to.turned);
  v.stream.wait();
  *to.frame = v.frame;
}

void DeviceVolume::look_up(const std::vector<Vec3f>& points, float near_m, std::vector<float>* distance_m,
                           std::vector<unsigned char>* looked_past) {
  Impl& v = *impl_;
  const DeviceScope scope(v.device);
  const std::size_t n = points.size(), of_points = aligned(n * sizeof(Vec3f)),
                    of_distances = aligned(n * sizeof(float));
  distance_m->resize(n), looked_past->resize(n);
  if (n == 0) return;
  unsigned char* const here = v.stage(of_points + of_distances + n);
  unsigned char* const there = v.staged.data();
  std::copy_n(points.data(), n, reinterpret_cast<Vec3f*>(here));
  v.stream.upload(here, n * sizeof(Vec3f), there);
  const sdf::Grid& grid = v.blocks.grid;
  launch(v.stream, blocks_of(static_cast<std::int64_t>(n), kThreadsPerVoxels),
         LookUp{grid, grid.view(v.phi.data()), v.of_voxels(), reinterpret_cast<const Vec3f*>(there),
                static_cast<int>(n), near_m, reinterpret_cast<float*>(there + of_points),
                there + of_points + of_distances});
  v.stream.download(there + of_points, of_distances + n, here + of_points);
  v.stream.wait();
  std::copy_n(reinterpret_cast<const float*>(here + of_points), n, distance_m->data());
  std::copy_n(here + of_points + of_distances, n, looked_past->data());
}

const LargeArray<float>& DeviceVolume::phi() const { return impl_->phi_here; }
std::vector<sdf::VoxelBox> DeviceVolume::surface_boxes() const {
  return boxes_of(impl_->blocks, impl_->surface_here);
}
double DeviceVolume::change_m() const { return impl_->change_m; }

}  // namespace sdftrack::levelset
