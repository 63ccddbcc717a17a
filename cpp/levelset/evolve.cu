// SPDX-License-Identifier: MIT
// The evolution on the GPU, by the formulas of evolve_terms.h.
#include "base/device_pool.h"
#include "base/launch.cuh"
#include "levelset/evolve.h"
#include "levelset/evolve_terms.h"

namespace sdftrack::levelset {

namespace {

struct Scale {
  static constexpr const char* kName = "level set: scale";
  static constexpr int kThreads = 256;
  float* values;
  float voxel_m;
  bool to_metres;
  std::int64_t n;
  __device__ void operator()() const {
    const std::int64_t i = static_cast<std::int64_t>(blockIdx.x) * kThreads + threadIdx.x;
    if (i < n) values[i] = to_metres ? values[i] * voxel_m : values[i] / voxel_m;
  }
};

// A block has a tile of a slice.
struct Volume {
  static constexpr int kWide = 32, kHigh = 8;
  int nx, ny, nz;

  dim3 tiles() const {
    return {blocks_of(nx, kWide), blocks_of(ny, kHigh),
            static_cast<unsigned>(nz < kMostSlices ? nz : kMostSlices)};
  }
  // work(x, y, z, its index) for the voxels of a thread.
  template <class Body>
  __device__ void each_of_mine(const Body& work) const {
    const int x = static_cast<int>(blockIdx.x) * kWide + static_cast<int>(threadIdx.x) % kWide,
              y = static_cast<int>(blockIdx.y) * kHigh + static_cast<int>(threadIdx.x) / kWide;
    if (x >= nx || y >= ny) return;
    for (int z = static_cast<int>(blockIdx.z); z < nz; z += static_cast<int>(gridDim.z))
      work(x, y, z, (static_cast<std::int64_t>(z) * ny + y) * nx + x);
  }
  __device__ Neighbours along(int axis, int x, int y, int z) const {
    return axis == 0 ? neighbours(x, nx, 1) : axis == 1 ? neighbours(y, ny, nx) : neighbours(z, nz, nx * ny);
  }

 private:
  static constexpr int kMostSlices = 65535;
};

// The flux is its slope times one number, which alone is kept: 4 bytes of a voxel in place of 12.
struct Excess {
  static constexpr const char* kName = "level set: excess";
  static constexpr int kThreads = Volume::kWide * Volume::kHigh;
  EvolveTerm<float> term;
  Volume volume;
  const float* phi;
  float* excess;
  __device__ void operator()() const {
    volume.each_of_mine([&](int x, int y, int z, std::int64_t i) {
      const Neighbours at[3] = {volume.along(0, x, y, z), volume.along(1, x, y, z), volume.along(2, x, y, z)};
      float slope[3];
      excess[i] = term.excess(at, phi + i, 1, slope);
    });
  }
};

struct Step {
  static constexpr const char* kName = "level set: step";
  static constexpr int kThreads = Excess::kThreads;
  EvolveTerm<float> term;
  Volume volume;
  const float *phi, *excess, *log_ratio;
  float* next;
  __device__ void operator()() const {
    volume.each_of_mine([&](int x, int y, int z, std::int64_t i) {
      const int place[3] = {x, y, z};
      Neighbours at[3];
      float flux[3][2];
      for (int k = 0; k < 3; ++k) {
        at[k] = volume.along(k, x, y, z);
        flux[k][0] = flux_at(k, place, at[k].before, -1, i),
        flux[k][1] = flux_at(k, place, at[k].after, 1, i);
        at[k].before = 0, at[k].after = 1;  // where they now lie
      }
      const float* const from[3] = {flux[0], flux[1], flux[2]};
      next[i] = term.step(at, phi + i, log_ratio + i, from, 1);
    });
  }

 private:
  // Along an axis, at the neighbour there or, at the volume's face, at the voxel itself (offset 0).
  __device__ float flux_at(int axis, const int (&place)[3], int offset, int by, std::int64_t i) const {
    const int d = offset == 0 ? 0 : by;
    const Neighbours at = volume.along(axis, place[0] + (axis == 0 ? d : 0), place[1] + (axis == 1 ? d : 0),
                                       place[2] + (axis == 2 ? d : 0));
    return excess[i + offset] * slope_along<float>(at, phi + i + offset, 1);
  }
};

struct Work {
  DeviceStream stream;
  DeviceBuffer<float> phi, next, excess, log_ratio;
};

}  // namespace

std::vector<float> evolve_cuda(const sdf::Grid& grid, const float* phi_m, const float* log_ratio, int steps,
                               const EvolveOptions& options, int device) {
  check_evolution(options, steps);
  std::vector<float> out(phi_m, phi_m + grid.size());
  if (steps == 0) return out;
  const EvolveTerm<float> term{1 / options.sigma_h, 1 / (options.sigma_phi * options.sigma_phi), options.dt,
                               options.printed};
  const auto voxel_m = static_cast<float>(grid.voxel_m);
  const auto n = static_cast<std::int64_t>(grid.size());
  const unsigned blocks = blocks_of(n, Scale::kThreads);
  const Volume volume{grid.nx, grid.ny, grid.nz};
  const auto work = pool_of<Work>().borrow(device);  // after `out`
  const DeviceStream& stream = work->stream;
  float *phi = work->phi.room(out.size()), *next = work->next.room(out.size());
  float *const excess = work->excess.room(out.size()), *const ratio = work->log_ratio.room(out.size());
  stream.upload(phi_m, out.size(), phi);
  stream.upload(log_ratio, out.size(), ratio);
  launch(stream, blocks, Scale{phi, voxel_m, false, n});
  for (int step = 0; step < steps; ++step) {
    launch(stream, volume.tiles(), Excess{term, volume, phi, excess});
    launch(stream, volume.tiles(), Step{term, volume, phi, excess, ratio, next});
    std::swap(phi, next);
  }
  launch(stream, blocks, Scale{phi, voxel_m, true, n});
  stream.download(phi, out.size(), out.data());
  stream.wait();
  return out;
}

}  // namespace sdftrack::levelset
