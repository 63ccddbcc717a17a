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

// A block of threads has a tile of some slices; a thread has the voxels of one column of the tile.
struct Volume {
  static constexpr int kWide = 32, kHigh = 8, kDeep = 8;  // kDeep: slices at a time
  int nx, ny, nz;

  dim3 tiles() const {
    return {blocks_of(nx, kWide), blocks_of(ny, kHigh), blocks_of(nz, kDeep, kMostBlocks)};
  }
  // Calls work(x, y, first z, last z + 1) for the columns of a thread.
  template <class Body>
  __device__ void each_of_mine(const Body& work) const {
    const int x = int(blockIdx.x) * kWide + int(threadIdx.x) % kWide,
              y = int(blockIdx.y) * kHigh + int(threadIdx.x) / kWide;
    if (x >= nx || y >= ny) return;
    for (std::int64_t z = std::int64_t{blockIdx.z} * kDeep; z < nz; z += std::int64_t{gridDim.z} * kDeep)
      work(x, y, int(z), int(z + kDeep < nz ? z + kDeep : nz));
  }
  __device__ std::int64_t index(int x, int y, int z) const {
    return (static_cast<std::int64_t>(z) * ny + y) * nx + x;
  }
  __device__ int slice() const { return nx * ny; }

 private:
  static constexpr int kMostBlocks = 65535;
};

// Puts the indices of two values that a thread holds where the formulas expect offsets into the volume.
__device__ inline Neighbours held(Neighbours at, int before, int after) {
  at.before = at.mirrored_before = before, at.after = at.mirrored_after = after;
  return at;
}
__device__ inline float slope_of(float before, float after, float per) {
  const float both[2] = {before, after};
  return slope_along<float>({0, 1, per, 0, 1, 0, 0}, both, 1);
}

// The flux is the slope times one number. Only this number is stored: 4 bytes per voxel in place of 12. A
// thread goes along z and keeps the values that the next voxel also needs.
struct Excess {
  static constexpr const char* kName = "level set: excess";
  static constexpr int kThreads = Volume::kWide * Volume::kHigh;
  EvolveTerm<float> term;
  Volume volume;
  const float* phi;
  float* excess;
  __device__ void operator()() const {
    volume.each_of_mine([this](int x, int y, int first, int end) {
      const int slice = volume.slice();
      const Neighbours along_x = neighbours(x, volume.nx, 1), along_y = neighbours(y, volume.ny, volume.nx);
      const Neighbours at[2] = {held(along_x, 1, 2), held(along_y, 3, 4)};
      const std::int64_t i = volume.index(x, y, first);
      const float* here = phi + i;
      float* out = excess + i;
      float before = here[first > 0 ? -slice : 0], own = here[0];
      for (int z = first; z < end; ++z, here += slice, out += slice) {
        const bool top = z == volume.nz - 1;
        const float after = here[top ? 0 : slice];
        const float around[7] = {own,
                                 here[along_x.before],
                                 here[along_x.after],
                                 here[along_y.before],
                                 here[along_y.after],
                                 before,
                                 after};
        const Neighbours all[3] = {at[0], at[1], held(neighbours(z, volume.nz, slice), 5, 6)};
        float slope[3];
        *out = term.excess(all, around, 1, slope);
        before = own, own = after;
      }
    });
  }
};

// The values that a step reads along x or y, as offsets from the voxel; equal for all voxels of a column.
struct AcrossColumn {
  Neighbours own;
  int far_before, far_after;  // outer ends of the slopes of this voxel's neighbours
  float per_before, per_after;

  __device__ static AcrossColumn at(int i, int n, int stride) {
    const Neighbours own = neighbours(i, n, stride);
    const Neighbours before = neighbours(own.before == 0 ? i : i - 1, n, stride),
                     after = neighbours(own.after == 0 ? i : i + 1, n, stride);
    return {own, own.before + before.before, own.after + after.after, before.per, after.per};
  }
  // The neighbouring values for the Laplacian, and the flux of the neighbours. At a face of the volume this
  // is the flux of the voxel, with the slope to the mirrored neighbour.
  __device__ void read(const float* phi, const float* excess, float value, float* beside, float* flux) const {
    beside[0] = phi[own.mirrored_before], beside[1] = phi[own.mirrored_after];
    const float to = own.before == 0 ? beside[0] : value, from = own.after == 0 ? beside[1] : value;
    flux[0] = excess[own.before] * slope_of(phi[far_before], to, per_before);
    flux[1] = excess[own.after] * slope_of(from, phi[far_after], per_after);
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
    volume.each_of_mine([this](int x, int y, int first, int end) { column(x, y, first, end); });
  }

 private:
  __device__ void column(int x, int y, int first, int end) const {
    const AcrossColumn across_x = AcrossColumn::at(x, volume.nx, 1),
                       across_y = AcrossColumn::at(y, volume.ny, volume.nx);
    const int nz = volume.nz, slice = volume.slice();
    const std::int64_t i = volume.index(x, y, first);
    const float *here = phi + i, *flows = excess + i, *ratio = log_ratio + i;
    float* out = next + i;
    const auto per = [nz](int z) { return z == 0 || z == nz - 1 ? 1.f : 0.5f; };
    // Along z: phi of three voxels, and the flux of two.
    float before = here[first > 0 ? -slice : 0], own = here[0], after = here[first < nz - 1 ? slice : 0];
    float flux_own = flows[0] * slope_of(before, after, per(first)), flux_before = flux_own;
    if (first > 0)
      flux_before = flows[-slice] * slope_of(here[first > 1 ? -2 * slice : -slice], own, per(first - 1));
    for (int z = first; z < end; ++z, here += slice, flows += slice, ratio += slice, out += slice) {
      const auto voxel = [&](const Neighbours& along_z, float far, float flux_after) {
        float around[7] = {own, 0, 0, 0, 0, 0, 0}, flux[3][2];
        across_x.read(here, flows, own, around + 1, flux[0]);
        across_y.read(here, flows, own, around + 3, flux[1]);
        around[5] = along_z.mirrored_before < 0 ? before : after;
        around[6] = along_z.mirrored_after > 0 ? after : before;
        flux[2][0] = flux_before, flux[2][1] = flux_after;
        const Neighbours at[3] = {beside(across_x.own, 1), beside(across_y.own, 3), beside(along_z, 5)};
        const float* const from[3] = {flux[0], flux[1], flux[2]};
        *out = term.step(at, around, ratio, from, 1);
        before = own, own = after, after = far, flux_before = flux_own, flux_own = flux_after;
      };
      if (z > 0 && z < nz - 2) {  // equal for all threads of a block
        const float far = here[2 * slice];
        voxel(neighbours(1, 3, slice), far, flows[slice] * slope_of(own, far, 0.5f));
      } else {
        const float far = z < nz - 2 ? here[2 * slice] : after;
        voxel(neighbours(z, nz, slice), far,
              z < nz - 1 ? flows[slice] * slope_of(own, far, per(z + 1)) : flux_own);
      }
    }
  }
  // Offsets into two values that are held one after the other, and into their flux.
  __device__ static Neighbours beside(Neighbours at, int first) {
    at.mirrored_before = first, at.mirrored_after = first + 1, at.before = 0, at.after = 1;
    return at;
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
  const auto voxel_m = float(grid.voxel_m);
  const auto n = static_cast<std::int64_t>(grid.size());
  const unsigned blocks = blocks_of(n, Scale::kThreads);
  const Volume volume{grid.nx, grid.ny, grid.nz};
  const auto work = pool_of<Work>().borrow(device);  // after `out`
  const DeviceStream& stream = work->stream;
  float *phi = work->phi.room(out.size()), *next = work->next.room(out.size());
  float *const excess = work->excess.room(out.size()), *const ratio = work->log_ratio.room(out.size());
  stream.upload(phi_m, out.size(), phi);
  stream.upload(log_ratio, out.size(), ratio);
  // A device that reads pageable host memory may still copy when the upload returns. The arrays belong to the
  // caller, who may free them; hence the wait.
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
