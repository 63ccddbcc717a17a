// SPDX-License-Identifier: MIT
#include "base/launch.cuh"
#include "contour/contour_terms.h"
#include "contour/steps_cuda.h"

namespace sdftrack::contour {

namespace {

constexpr int kTile = 16;

// `first`: phi before the first step, which says what the band is.
struct EvolveCells {
  static constexpr const char* kName = "contour step";
  static constexpr int kThreads = kTile * kTile;
  ContourStep<float> term;
  float band;
  int nx, ny;
  const float *first, *phi, *foreground;
  float* out;

  __device__ void operator()() const {
    const int x = static_cast<int>(blockIdx.x * kTile + threadIdx.x),
              y = static_cast<int>(blockIdx.y * kTile + threadIdx.y);
    if (x >= nx || y >= ny) return;
    const int at = y * nx + x;
    const bool inner = x > 0 && y > 0 && x + 1 < nx && y + 1 < ny;
    out[at] = inner && fabsf(first[at]) <= band ? term.step(phi + at, nx, foreground[at], 1) : phi[at];
  }
};

}  // namespace

std::vector<float> contour_steps_cuda(const ContourOptions& options, int steps, int nx, int ny,
                                      const float* phi, const float* foreground, int device) {
  const DeviceScope scope(device);
  const DeviceStream stream;
  const std::size_t cells = static_cast<std::size_t>(nx) * static_cast<std::size_t>(ny);
  DeviceBuffer<float> first(cells), now(cells), next(cells), posterior(cells);
  for (DeviceBuffer<float>* const to : {&first, &now}) stream.upload(phi, cells, to->data());
  stream.upload(foreground, cells, posterior.data());
  const ContourStep<float> term{1 / options.softness, options.dt, options.mu, options.tension};
  const dim3 tiles(blocks_of(nx, kTile), blocks_of(ny, kTile));
  for (int k = 0; k < steps; ++k) {
    launch(stream, tiles,
           EvolveCells{term, options.band, nx, ny, first.data(), now.data(), posterior.data(), next.data()},
           dim3(kTile, kTile));
    std::swap(now, next);
  }
  std::vector<float> out(cells);
  const StreamWaiter waiter(stream);
  stream.download(now.data(), cells, out.data());
  stream.wait();
  return out;
}

}  // namespace sdftrack::contour
