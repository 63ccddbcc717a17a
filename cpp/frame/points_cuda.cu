// SPDX-License-Identifier: MIT
// One warp per pose. It adds in the order of energies/block.h: kLanes partial sums in the first lanes of the
// warp, which are added into double after every kBlock contributions.
#include <map>

#include "base/launch.cuh"
#include "energies/block.h"
#include "frame/points_cuda.h"

namespace sdftrack::frame {

namespace {

using energies::Contribution;
using energies::kBlock;
using energies::kLanes;

constexpr int kWarp = 32, kPosesOfBlock = 4;
constexpr unsigned kAll = 0xffffffffu;
static_assert(kWarp == 2 * kLanes && kBlock % kLanes == 0);

// N numbers that the warp sums over contributions.
template <int N>
struct WarpSums {
  float part[N] = {};  // one of the partial sums, in the first kLanes lanes
  double total = 0;    // of number n in lane n
  int filled = 0;

  // The value of each of the first kLanes lanes.
  __device__ void add(const float (&value)[N]) {
#pragma unroll
    for (int n = 0; n < N; ++n) part[n] += value[n];
    filled += kLanes;
    if (filled == kBlock) flush();
  }
  __device__ void flush() {
    const int lane = int(threadIdx.x) % kWarp;
#pragma unroll
    for (int n = 0; n < N; ++n) {
      float sum = part[n];
#pragma unroll
      for (int half = kLanes / 2; half > 0; half /= 2) sum += __shfl_down_sync(kAll, sum, half);
      sum = __shfl_sync(kAll, sum, 0);
      if (lane == n) total += double(sum);
      part[n] = 0;
    }
    filled = 0;
  }
};

// Calls `add` with the contribution of a point in each of the first kLanes lanes, 0 beyond the last point.
template <class Term, class Add>
__device__ void each_lanes(const Term& term, int count, const Add& add) {
  const int lane = int(threadIdx.x) % kWarp;
  for (int first = 0; first < count; first += kWarp) {
    Contribution<float, 6> c{};
    if (first + lane < count) c = term.linearize(first + lane);
    add(c);
    if (first + kLanes >= count) return;
    c.cost = __shfl_down_sync(kAll, c.cost, kLanes), c.slope = __shfl_down_sync(kAll, c.slope, kLanes);
    c.curvature = __shfl_down_sync(kAll, c.curvature, kLanes);
#pragma unroll
    for (int a = 0; a < 6; ++a) c.J[a] = __shfl_down_sync(kAll, c.J[a], kLanes);
    add(c);
  }
}

// The terms of a warp's pose; none for surplus warps.
struct Poses {
  const QuickTerms* terms;
  const PoseOf* poses;
  int count;

  __device__ int of_warp() const { return int(blockIdx.x) * kPosesOfBlock + int(threadIdx.x) / kWarp; }
  __device__ QuickTerms at(int k) const {
    QuickTerms moved = terms[poses[k].terms];
    moved.move_to(poses[k].T_obj_cam);
    return moved;
  }
};

constexpr int kSummed = 6 + 6 * 7 / 2;  // gradient and Hessian

struct LinearizePoses {
  static constexpr const char* kName = "poses: linearize";
  static constexpr int kThreads = kWarp * kPosesOfBlock;
  Poses poses;
  double* out;  // kSummed for each pose

  __device__ void operator()() const {
    const int k = poses.of_warp(), lane = int(threadIdx.x) % kWarp;
    if (k >= poses.count) return;
    const QuickTerms terms = poses.at(k);
    WarpSums<kSummed> sums;
    const auto add = [&sums](const Contribution<float, 6>& c) {
      float value[kSummed];
      int n = 6;
#pragma unroll
      for (int a = 0; a < 6; ++a) {
        value[a] = c.slope * c.J[a];
        const float weighted = c.curvature * c.J[a];
#pragma unroll
        for (int b = 0; b <= a; ++b) value[n++] = weighted * c.J[b];
      }
      sums.add(value);
    };
    each_lanes(terms.readings, terms.readings.readings_cam.count(), add);
    each_lanes(terms.solids, terms.solids.readings_cam.count(), add);
    each_lanes(terms.surface, terms.surface.points_obj.count(), add);
    each_lanes(terms.outline, terms.outline.points_obj.count(), add);
    if (sums.filled > 0) sums.flush();
    if (lane < kSummed) out[std::size_t(k) * kSummed + lane] = sums.total;
  }
};

struct CostOfPoses {
  static constexpr const char* kName = "poses: cost";
  static constexpr int kThreads = kWarp * kPosesOfBlock;
  Poses poses;
  QuickCost* out;

  __device__ void operator()() const {
    const int k = poses.of_warp(), lane = int(threadIdx.x) % kWarp;
    if (k >= poses.count) return;
    const QuickTerms terms = poses.at(k);
    const Sum readings = cost_of(terms.readings, terms.readings.readings_cam.count()),
              solids = cost_of(terms.solids, terms.solids.readings_cam.count()),
              surface = cost_of(terms.surface, terms.surface.points_obj.count()),
              outline = cost_of(terms.outline, terms.outline.points_obj.count());
    if (lane == 0) out[k] = {readings.cost + solids.cost, surface.cost, outline.cost, surface.counted};
  }

 private:
  struct Sum {
    double cost, counted;  // counted: the points that have a cost
  };
  template <class Term>
  __device__ static Sum cost_of(const Term& term, int count) {
    WarpSums<2> sums;
    each_lanes(term, count, [&sums](const Contribution<float, 6>& c) {
      sums.add({c.cost, c.curvature > 0 ? 1.0f : 0.0f});
    });
    sums.flush();
    return {__shfl_sync(kAll, sums.total, 0), __shfl_sync(kAll, sums.total, 1)};
  }
};

}  // namespace

struct PointsOnDevice::Impl {
  energies::CudaWork* work;
  std::map<const void*, const void*> sent;  // device address by host address
  std::vector<DeviceBuffer<float>> lists;   // the first sent.size() are in use
  DeviceBuffer<QuickTerms> terms;
  DeviceBuffer<PoseOf> poses;
  DeviceBuffer<double> sums;
  DeviceBuffer<QuickCost> costs;
  PinnedBuffer<double> sums_here;
  std::vector<QuickTerms> terms_there;

  template <class T>
  void send(const T** list, std::size_t count) {
    static_assert(sizeof(T) % sizeof(float) == 0);
    if (count == 0) return;
    const auto known = sent.find(*list);
    if (known == sent.end()) {
      if (lists.size() == sent.size()) lists.emplace_back();
      const std::size_t floats = count * sizeof(T) / sizeof(float);
      float* const there = lists[sent.size()].room(floats);
      work->stream().upload(reinterpret_cast<const float*>(*list), floats, there);
      sent.emplace(*list, there);
      *list = reinterpret_cast<const T*>(there);
    } else {
      *list = static_cast<const T*>(known->second);
    }
  }
  void send(PointsView* view) { send(&view->points, std::size_t(view->n)); }

  // Uploads the terms and all data that they read.
  Poses prepare(const std::vector<QuickTerms>& here, const std::vector<PoseOf>& at) {
    terms_there = here;
    for (QuickTerms& t : terms_there) {
      SdfView& sdf = t.readings.field.sdf;
      if (sdf.id != 0)
        sdf = work->volume(sdf);
      else
        send(&sdf.phi, std::size_t(sdf.nx) * sdf.ny * sdf.nz);
      t.solids.field.sdf = sdf;
      for (PointsView* const view : {&t.readings.readings_cam, &t.solids.readings_cam, &t.surface.points_obj,
                                     &t.surface.normals_obj, &t.outline.points_obj})
        send(view);
      if (t.surface.points_obj.n > 0) {
        NodesView& nodes = t.surface.nodes;
        send(&nodes.depth_m, std::size_t(nodes.width) * nodes.height);
      }
      if (t.outline.points_obj.n > 0) {
        energies::DistanceView& grid = t.outline.grid;
        send(&grid.distance_px, std::size_t(grid.width) * grid.height);
      }
    }
    QuickTerms* const terms_gpu = terms.room(here.size());
    PoseOf* const poses_gpu = poses.room(at.size());
    work->stream().upload(terms_there.data(), here.size(), terms_gpu);
    work->stream().upload(at.data(), at.size(), poses_gpu);
    return {terms_gpu, poses_gpu, int(at.size())};
  }
};

PointsOnDevice::PointsOnDevice(energies::CudaWork* work) : impl_(std::make_unique<Impl>()) {
  impl_->work = work;
}
PointsOnDevice::~PointsOnDevice() = default;

void PointsOnDevice::begin() { impl_->sent.clear(); }

void PointsOnDevice::linearize(const std::vector<QuickTerms>& terms, const std::vector<PoseOf>& poses,
                               std::vector<energies::Sums<double, 6>>* out) {
  out->assign(poses.size(), {});
  if (poses.empty()) return;
  Impl& d = *impl_;
  const DeviceScope scope(d.work->device());
  const DeviceStream& stream = d.work->stream();
  const StreamWaiter waiter(stream);
  const std::size_t count = poses.size() * kSummed;
  const Poses there = d.prepare(terms, poses);
  double *sums = d.sums.room(count), *here = d.sums_here.room(count);
  launch(stream, blocks_of(there.count, kPosesOfBlock), LinearizePoses{there, sums});
  stream.download(sums, count, here);
  stream.wait();
  for (std::size_t k = 0; k < poses.size(); ++k, here += kSummed) {
    std::copy_n(here, 6, (*out)[k].gradient);
    std::copy_n(here + 6, kSummed - 6, (*out)[k].hessian);
  }
}

void PointsOnDevice::cost(const std::vector<QuickTerms>& terms, const std::vector<PoseOf>& poses,
                          std::vector<QuickCost>* out) {
  out->resize(poses.size());
  if (poses.empty()) return;
  Impl& d = *impl_;
  const DeviceScope scope(d.work->device());
  const DeviceStream& stream = d.work->stream();
  const StreamWaiter waiter(stream);
  const Poses there = d.prepare(terms, poses);
  QuickCost* const costs = d.costs.room(poses.size());
  launch(stream, blocks_of(there.count, kPosesOfBlock), CostOfPoses{there, costs});
  stream.download(costs, poses.size(), out->data());
  stream.wait();
}

}  // namespace sdftrack::frame
