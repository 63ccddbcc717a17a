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
  static constexpr int kWide = 32, kHigh = 8, kDeep = 8;  // kDeep: slices of a thread, at least
  int nx, ny, nz;

  dim3 tiles() const {
    return {blocks_of(nx, kWide), blocks_of(ny, kHigh), blocks_of(nz, kDeep, kMostBlocks)};
  }
  // work(its place, its index) for the voxels of a thread. Most lie far from the faces; for them the compiler
  // knows where their neighbours are.
  template <class Body>
  __device__ void each_of_mine(const Body& work) const {
    const int x = static_cast<int>(blockIdx.x) * kWide + static_cast<int>(threadIdx.x) % kWide,
              y = static_cast<int>(blockIdx.y) * kHigh + static_cast<int>(threadIdx.x) / kWide;
    if (x >= nx || y >= ny) return;
    for (int z = static_cast<int>(blockIdx.z); z < nz; z += static_cast<int>(gridDim.z)) {
      const std::int64_t i = (static_cast<std::int64_t>(z) * ny + y) * nx + x;
      if (x > 1 && y > 1 && z > 1 && x < nx - 2 && y < ny - 2 && z < nz - 2)
        work(Within{{1, nx, nx * ny}}, i);
      else
        work(Anywhere{{x, y, z}, {nx, ny, nz}, {1, nx, nx * ny}}, i);
    }
  }

 private:
  static constexpr int kMostBlocks = 65535;

  struct Within {
    int stride[3];
    // Of the voxel that is `by` further along the axis.
    __device__ Neighbours along(int axis, int) const { return neighbours(1, 3, stride[axis]); }
  };
  struct Anywhere {
    int place[3], size[3], stride[3];
    __device__ Neighbours along(int axis, int by) const {
      return neighbours(place[axis] + by, size[axis], stride[axis]);
    }
  };
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
    volume.each_of_mine([&](const auto& place, std::int64_t i) {
      const Neighbours at[3] = {place.along(0, 0), place.along(1, 0), place.along(2, 0)};
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
    volume.each_of_mine([&](const auto& place, std::int64_t i) {
      Neighbours at[3];
      float flux[3][2];
      for (int k = 0; k < 3; ++k) {
        at[k] = place.along(k, 0);
        // At a face of the volume it is that of the voxel itself.
        const auto flux_at = [&](int offset, int by) {
          return excess[i + offset] *
                 slope_along<float>(place.along(k, offset == 0 ? 0 : by), phi + i + offset, 1);
        };
        flux[k][0] = flux_at(at[k].before, -1), flux[k][1] = flux_at(at[k].after, 1);
        at[k].before = 0, at[k].after = 1;  // where they now lie
      }
      const float* const from[3] = {flux[0], flux[1], flux[2]};
      next[i] = term.step(at, phi + i, log_ratio + i, from, 1);
    });
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
  // Where a device reads pageable memory of the host itself, a copy may still be under way when the upload
  // returns; the arrays are the caller's, and nothing from here on keeps them.
  stream.wait();
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
