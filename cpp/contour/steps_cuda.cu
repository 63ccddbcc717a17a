// SPDX-License-Identifier: MIT
#include "base/device_pool.h"
#include "base/launch.cuh"
#include "contour/contour_terms.h"
#include "contour/steps_cuda.h"

namespace sdftrack::contour {

namespace {

constexpr int kTile = 16;

struct EvolveCells {
  static constexpr const char* kName = "contour step";
  static constexpr int kThreads = kTile * kTile;
  ContourStep<float> term;
  int nx, ny;
  const unsigned char* in_band;  // 1: the cell moves
  const float *phi, *foreground;
  float* out;

  __device__ void operator()() const {
    const int x = int(blockIdx.x * kTile + threadIdx.x), y = int(blockIdx.y * kTile + threadIdx.y);
    if (x >= nx || y >= ny) return;
    const int at = y * nx + x;
    out[at] = in_band[at] ? term.step(phi + at, nx, foreground[at], 1) : phi[at];
  }
};

struct Work {
  DeviceStream stream;
  DeviceBuffer<float> phi, next, foreground;
  DeviceBuffer<unsigned char> in_band;
};

}  // namespace

void evolve_contour_cuda(const ContourOptions& options, int steps, int device, EvolutionWork* work,
                         ContourGrid* grid) {
  const std::size_t cells = grid->phi.size();
  work->next.resize(cells), work->in_band.assign(cells, 0);
  for (const CellRun& run : work->band) {
    unsigned char* const row = work->in_band.data() + std::ptrdiff_t(run.row) * grid->nx;
    std::fill(row + run.first, row + run.last, 1);
  }
  const auto there = pool_of<Work>().borrow(device);
  const DeviceStream& stream = there->stream;
  float *phi = there->phi.room(cells), *next = there->next.room(cells);
  float* const foreground = there->foreground.room(cells);
  unsigned char* const in_band = there->in_band.room(cells);
  stream.upload(grid->phi.data(), cells, phi);
  stream.upload(work->foreground.data(), cells, foreground);
  stream.upload(work->in_band.data(), cells, in_band);
  const ContourStep<float> term{1 / options.softness, options.dt, options.mu, options.tension};
  const dim3 tiles(blocks_of(grid->nx, kTile), blocks_of(grid->ny, kTile));
  for (int k = 0; k < steps; ++k) {
    launch(stream, tiles, EvolveCells{term, grid->nx, grid->ny, in_band, phi, foreground, next},
           dim3(kTile, kTile));
    std::swap(phi, next);
  }
  stream.download(phi, cells, work->next.data());
  stream.wait();
  std::swap(grid->phi, work->next);
}

}  // namespace sdftrack::contour
