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

// A block moves a tile along z. It holds the last slices of phi and of the flux, so that each voxel is read
// once and each flux computed about once: a flux depends on phi at the next voxels, a step on the flux there.
struct Step {
  static constexpr const char* kName = "level set: step";
  static constexpr int kWide = 32, kHigh = 16, kThreads = kWide * kHigh;  // of the flux
  static constexpr int kStepWide = kWide - 2, kStepHigh = kHigh - 2;      // of the steps: without its edge
  static constexpr int kPhiWide = kWide + 2, kPhiHigh = kHigh + 2;        // of phi: with one more around it
  static constexpr int kPhiSlice = kPhiWide * kPhiHigh;
  static constexpr int kPhiSlots = 5, kFluxSlots = 3, kSlices = 32;
  EvolveTerm<float> term;
  int nx, ny, nz;
  const float *phi, *log_ratio;
  float* next;

  __device__ void operator()() const {
    SDFTRACK_SHARED(float[kPhiSlots][kPhiSlice], held);
    SDFTRACK_SHARED(float[3][kFluxSlots][kThreads], flux);
    const int column = static_cast<int>(threadIdx.x) % kWide, row = static_cast<int>(threadIdx.x) / kWide;
    const int x = static_cast<int>(blockIdx.x) * kStepWide + column - 1;
    const int y = static_cast<int>(blockIdx.y) * kStepHigh + row - 1;
    const bool has_flux = x >= 0 && x < nx && y >= 0 && y < ny;
    const bool steps = has_flux && column > 0 && column <= kStepWide && row > 0 && row <= kStepHigh;
    const int first = static_cast<int>(blockIdx.z) * kSlices,
              end = first + kSlices < nz ? first + kSlices : nz;
    const int phi_at = (row + 1) * kPhiWide + column + 1;
    Neighbours in_phi[3], in_flux[3];
    in_phi[0] = in_flux[0] = neighbours(x, nx, 1);
    in_phi[1] = neighbours(y, ny, kPhiWide), in_flux[1] = neighbours(y, ny, kWide);
    load_slice(first - 2, held), load_slice(first - 1, held), load_slice(first, held);
    for (int s = first - 1; s <= end; ++s) {  // the flux of slice s, then the step of slice s - 1
      load_slice(s + 1, held);
      __syncthreads();
      if (has_flux && s >= 0 && s < nz) {
        in_phi[2] = along_z(s, kPhiSlots, kPhiSlice);
        float out[3];
        term.flux(in_phi, held[s % kPhiSlots] + phi_at, 1, out);
        for (int k = 0; k < 3; ++k) flux[k][s % kFluxSlots][threadIdx.x] = out[k];
      }
      __syncthreads();
      if (steps && s > first) step(s - 1, x, y, in_phi, in_flux, held[(s - 1) % kPhiSlots] + phi_at, flux);
    }
  }

 private:
  __device__ std::int64_t index(int x, int y, int z) const {
    return (static_cast<std::int64_t>(z) * ny + y) * nx + x;
  }

  __device__ void load_slice(int z, float (&held)[kPhiSlots][kPhiSlice]) const {
    if (z < 0 || z >= nz) return;
    const int x0 = static_cast<int>(blockIdx.x) * kStepWide - 2,
              y0 = static_cast<int>(blockIdx.y) * kStepHigh - 2;
    for (int k = static_cast<int>(threadIdx.x); k < kPhiSlice; k += kThreads) {
      const int x = x0 + k % kPhiWide, y = y0 + k / kPhiWide;
      if (x >= 0 && x < nx && y >= 0 && y < ny) held[z % kPhiSlots][k] = phi[index(x, y, z)];
    }
  }

  // The neighbours of slice z in a ring of slots.
  __device__ Neighbours along_z(int z, int slots, int stride) const {
    Neighbours at = neighbours(z, nz, 1);
    const auto offset = [&](int by) { return ((z + by) % slots - z % slots) * stride; };
    at.before = offset(at.before), at.after = offset(at.after);
    at.mirrored_before = offset(at.mirrored_before), at.mirrored_after = offset(at.mirrored_after);
    return at;
  }

  // term.step with phi and the flux each at the offsets of its own tile.
  __device__ void step(int z, int x, int y, Neighbours* in_phi, Neighbours* in_flux, const float* own,
                       const float (&flux)[3][kFluxSlots][kThreads]) const {
    in_phi[2] = along_z(z, kPhiSlots, kPhiSlice), in_flux[2] = along_z(z, kFluxSlots, kThreads);
    float around[3][2];
    Neighbours at[3];
    const float* from[3];
    for (int k = 0; k < 3; ++k) {
      const float* const here = flux[k][z % kFluxSlots] + threadIdx.x;
      around[k][0] = here[in_flux[k].before], around[k][1] = here[in_flux[k].after];
      at[k] = in_phi[k], at[k].before = 0, at[k].after = 1;  // where they now lie
      from[k] = around[k];
    }
    const std::int64_t i = index(x, y, z);
    next[i] = term.step(at, own, log_ratio + i, from, 1);
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
  const auto n = static_cast<std::int64_t>(grid.size());
  const unsigned blocks = blocks_of(n, Scale::kThreads);
  const dim3 tiles(blocks_of(grid.nx, Step::kStepWide), blocks_of(grid.ny, Step::kStepHigh),
                   blocks_of(grid.nz, Step::kSlices));
  const auto work = pool_of<Work>().borrow(device);  // after `out`
  const DeviceStream& stream = work->stream;
  float *phi = work->phi.room(out.size()), *next = work->next.room(out.size());
  float* const ratio = work->log_ratio.room(out.size());
  stream.upload(phi_m, out.size(), phi);
  stream.upload(log_ratio, out.size(), ratio);
  launch(stream, blocks, Scale{phi, voxel_m, false, n});
  for (int step = 0; step < steps; ++step) {
    launch(stream, tiles, Step{term, grid.nx, grid.ny, grid.nz, phi, ratio, next});
    std::swap(phi, next);
  }
  launch(stream, blocks, Scale{phi, voxel_m, true, n});
  stream.download(phi, out.size(), out.data());
  stream.wait();
  return out;
}

}  // namespace sdftrack::levelset
