// SPDX-License-Identifier: MIT
#include "base/device_buffer.h"
#include "contour/contour_terms.h"
#include "contour/steps_cuda.h"

namespace sdftrack::contour {

namespace {

constexpr unsigned kTile = 16;

// `first`: phi before the first step, which says what the band is.
__global__ void contour_step_kernel(ContourStep<float> term, float band, int nx, int ny, const float* first,
                                    const float* phi, const float* foreground, float* out) {
  const int x = static_cast<int>(blockIdx.x * blockDim.x + threadIdx.x),
            y = static_cast<int>(blockIdx.y * blockDim.y + threadIdx.y);
  if (x >= nx || y >= ny) return;
  const int at = y * nx + x;
  const bool inner = x > 0 && y > 0 && x + 1 < nx && y + 1 < ny;
  out[at] = inner && fabsf(first[at]) <= band ? term.step(phi + at, nx, foreground[at], 1) : phi[at];
}

}  // namespace

std::vector<float> contour_steps_cuda(const ContourOptions& options, int steps, int nx, int ny,
                                      const float* phi, const float* foreground) {
  const std::size_t cells = static_cast<std::size_t>(nx) * static_cast<std::size_t>(ny);
  DeviceBuffer<float> first(cells), now(cells), next(cells), posterior(cells);
  first.upload(phi, cells), now.upload(phi, cells), posterior.upload(foreground, cells);
  const ContourStep<float> term{1 / options.softness, options.dt, options.mu, options.tension};
  const dim3 block(kTile, kTile);
  const dim3 tiles((static_cast<unsigned>(nx) + kTile - 1) / kTile,
                   (static_cast<unsigned>(ny) + kTile - 1) / kTile);
  for (int k = 0; k < steps; ++k) {
    contour_step_kernel<<<tiles, block>>>(term, options.band, nx, ny, first.data(), now.data(),
                                          posterior.data(), next.data());
    SDFTRACK_CHECK_CUDA(cudaGetLastError());
    std::swap(now, next);
  }
  return now.to_host();
}

}  // namespace sdftrack::contour
