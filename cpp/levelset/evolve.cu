// SPDX-License-Identifier: MIT
// The evolution on the GPU: the formulas of evolve_terms.h, a thread for each voxel.
#include "base/device_pool.h"
#include "base/launch.cuh"
#include "levelset/evolve.h"
#include "levelset/evolve_terms.h"

namespace sdftrack::levelset {

namespace {

constexpr int kBlockThreads = 256;

// The last threads of a volume of nearly 2^31 voxels count beyond what an int holds.
__device__ std::int64_t voxel_of_thread() {
  return static_cast<std::int64_t>(blockIdx.x) * kBlockThreads + threadIdx.x;
}

struct Volume {
  int nx, ny, nz;

  HD int size() const { return nx * ny * nz; }
  // The neighbours of a voxel along x, y and z.
  HD void around(int i, Neighbours* at) const {
    const int slice = nx * ny;
    at[0] = neighbours(i % nx, nx, 1);
    at[1] = neighbours(i / nx % ny, ny, nx);
    at[2] = neighbours(i / slice, nz, slice);
  }
};

struct Scale {
  static constexpr const char* kName = "level set: scale";
  static constexpr int kThreads = kBlockThreads;
  float* values;
  float voxel_m;
  bool to_metres;
  int n;
  __device__ void operator()() const {
    const std::int64_t i = voxel_of_thread();
    if (i < n) values[i] = to_metres ? values[i] * voxel_m : values[i] / voxel_m;
  }
};

// The flux is computed where it is needed, six times as often as it would have to be: the step is bound by
// memory, and a stored flux is 24 of 40 bytes.
struct Step {
  static constexpr const char* kName = "level set: step";
  static constexpr int kThreads = kBlockThreads;
  EvolveTerm<float> term;
  Volume volume;
  const float *phi, *log_ratio;
  float* next;
  __device__ void operator()() const {
    if (voxel_of_thread() >= volume.size()) return;
    const int i = static_cast<int>(voxel_of_thread());
    Neighbours at[3];
    volume.around(i, at);
    float flux[3][2];
    for (int k = 0; k < 3; ++k) {
      flux[k][0] = flux_along(k, i + at[k].before), flux[k][1] = flux_along(k, i + at[k].after);
      at[k].before = 0, at[k].after = 1;  // where they now lie
    }
    const float* const from[3] = {flux[0], flux[1], flux[2]};
    next[i] = term.step(at, phi + i, log_ratio + i, from, 1);
  }

 private:
  __device__ float flux_along(int axis, int i) const {
    Neighbours at[3];
    volume.around(i, at);
    float out[3];
    term.flux(at, phi + i, 1, out);
    return out[axis];
  }
};

struct Work {
  DeviceStream stream;
  DeviceBuffer<float> phi, next, log_ratio;
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
  const Volume volume{grid.nx, grid.ny, grid.nz};
  const int n = volume.size();
  const unsigned blocks = blocks_of(n, kBlockThreads);
  const auto work = pool_of<Work>().borrow(device);  // after `out`
  const DeviceStream& stream = work->stream;
  float *phi = work->phi.room(out.size()), *next = work->next.room(out.size());
  float* const ratio = work->log_ratio.room(out.size());
  stream.upload(phi_m, out.size(), phi);
  stream.upload(log_ratio, out.size(), ratio);
  // Where a device reads pageable memory of the host itself, a copy may still be under way when the upload
  // returns; the arrays are the caller's, and nothing from here on keeps them.
  stream.wait();
  launch(stream, blocks, Scale{phi, voxel_m, false, n});
  for (int step = 0; step < steps; ++step) {
    launch(stream, blocks, Step{term, volume, phi, ratio, next});
    std::swap(phi, next);
  }
  launch(stream, blocks, Scale{phi, voxel_m, true, n});
  stream.download(phi, out.size(), out.data());
  stream.wait();
  return out;
}

}  // namespace sdftrack::levelset
