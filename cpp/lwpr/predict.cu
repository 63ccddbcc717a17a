// SPDX-License-Identifier: MIT
// Predictions of many samples on the GPU: one thread for a sample and an output looks at all fields of the
// output. The formulas are those of the CPU (field_terms.h); sums run in the same order, exp is the GPU's
// own.
#include <cmath>
#include <limits>

#include "base/device_buffer.h"
#include "lwpr/field_terms.h"
#include "lwpr/model.h"

namespace sdftrack::lwpr {

namespace {

constexpr int kThreadsPerBlock = 128;

struct UnitView {
  FieldLayout at;
  const double* blocks;
  int fields;
  double q_max;
};

// NaN where no field that is ready is active: the host knows what to say there.
__global__ void predict_kernel(UnitView unit, const double* rows, std::size_t count, double* mean) {
  const std::size_t i = static_cast<std::size_t>(blockIdx.x) * blockDim.x + threadIdx.x;
  if (i >= count) return;
  const double* const x = rows + i * static_cast<std::size_t>(unit.at.row);
  double w_sum = 0, wy = 0;
  for (int k = 0; k < unit.fields; ++k) {
    const LanesAt<double> read{
        unit.blocks + static_cast<std::size_t>(k / kFieldLanes) * unit.at.block_size() + k % kFieldLanes};
    const double q = field_distance2<0>(unit.at, read, x);
    if (!(q < unit.q_max)) continue;
    const double w = exp(-0.5 * q) * read(unit.at.ready());
    w_sum += w;
    wy += w * field_value<0>(unit.at, read, x);
  }
  mean[i] = w_sum > 0 ? wy / w_sum : nan("");
}

}  // namespace

void LwprModel::predict_cuda(const double* x, std::size_t count, double* mean) const {
  const std::vector<double> rows = scaled_rows(x, count, "x");
  if (count == 0) return;
  const DeviceBuffer<double> rows_gpu(rows);
  DeviceBuffer<double> mean_gpu(count);
  LwprScratch scratch;
  const auto m = static_cast<std::size_t>(n_out()), row = static_cast<std::size_t>(at_.row);
  const auto grid = static_cast<unsigned>((count + kThreadsPerBlock - 1) / kThreadsPerBlock);
  for (std::size_t output = 0; output < m; ++output) {
    const LwprUnit& unit = units_[output];
    const DeviceBuffer<double> blocks(unit.blocks());
    predict_kernel<<<grid, kThreadsPerBlock>>>({at_, blocks.data(), unit.size(), unit.q_max()},
                                               rows_gpu.data(), count, mean_gpu.data());
    SDFTRACK_CHECK_CUDA(cudaGetLastError());
    const std::vector<double> said = mean_gpu.to_host();
    for (std::size_t i = 0; i < count; ++i) {
      const double value = std::isnan(said[i]) ? unit.predict(rows.data() + i * row, &scratch) : said[i];
      mean[i * m + output] = value * norm_out_[output];
    }
  }
}

}  // namespace sdftrack::lwpr
