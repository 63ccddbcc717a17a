// SPDX-License-Identifier: MIT
// Predictions of many samples on the GPU: one thread for a sample and an output looks at all fields of the
// output. The formulas are those of the CPU (field_terms.h), sums run in the same order: the same bits.
#include <cmath>
#include <vector>

#include "base/device_pool.h"
#include "base/launch.cuh"
#include "lwpr/exponential.h"
#include "lwpr/field_terms.h"
#include "lwpr/model.h"

namespace sdftrack::lwpr {

namespace {

// Numbers of one sample, which lie `stride` apart: threads side by side read what lies side by side.
struct Column {
  const double* at;
  std::size_t stride;
  HD double operator[](int i) const { return at[static_cast<std::size_t>(i) * stride]; }
};

struct UnitOnDevice {
  std::size_t first;  // of its blocks
  int fields;
  double q_max;
};

// A row of blocks for each output. NaN where no field that is ready is active: the host knows what to say
// there.
struct Predict {
  static constexpr const char* kName = "LWPR prediction";
  static constexpr int kThreads = 128;
  FieldLayout at;
  const UnitOnDevice* units;
  const double *blocks, *x;
  std::size_t count;
  double* mean;

  __device__ void operator()() const {
    const std::size_t i = static_cast<std::size_t>(blockIdx.x) * kThreads + threadIdx.x;
    if (i >= count) return;
    const UnitOnDevice unit = units[blockIdx.y];
    const Column sample{x + i, count};
    double w_sum = 0, wy = 0;
    for (int k = 0; k < unit.fields; ++k) {
      const LanesAt<double> read{blocks + unit.first +
                                 static_cast<std::size_t>(k / kFieldLanes) * at.block_size() +
                                 k % kFieldLanes};
      const double q = field_distance2<0>(at, read, sample);
      if (!(q < unit.q_max)) continue;
      const double w = exp_of<long long>(-0.5 * q) * read(at.ready());
      w_sum += w;
      wy += w * field_value<0>(at, read, sample);
    }
    mean[blockIdx.y * count + i] = w_sum > 0 ? wy / w_sum : nan("");
  }
};

struct Work {
  DeviceStream stream;
  DeviceBuffer<UnitOnDevice> units;
  DeviceBuffer<double> blocks, x, mean;
};

// (count, row) as (n, count).
std::vector<double> columns_of(const std::vector<double>& rows, std::size_t count, std::size_t row,
                               std::size_t n) {
  std::vector<double> out(n * count);
  for (std::size_t i = 0; i < count; ++i)
    for (std::size_t j = 0; j < n; ++j) out[j * count + i] = rows[i * row + j];
  return out;
}

}  // namespace

void LwprModel::predict_cuda(const double* x, std::size_t count, int device, double* mean) const {
  const std::vector<double> rows = scaled_rows(x, count, "x");
  if (count == 0) return;
  const auto m = static_cast<std::size_t>(n_out()), row = static_cast<std::size_t>(at_.row);
  const std::vector<double> columns = columns_of(rows, count, row, static_cast<std::size_t>(at_.n));
  std::vector<UnitOnDevice> units;
  std::size_t numbers = 0;
  const std::vector<LwprUnit>& now = this->units();
  for (const LwprUnit& unit : now) {
    units.push_back({numbers, unit.size(), unit.q_max()});
    numbers += unit.blocks().size();
  }
  std::vector<double> said(m * count);
  const auto work =
      pool_of<Work>().borrow(device);  // after `said`: what is written there has arrived before it goes
  const DeviceStream& stream = work->stream;
  double* const blocks = work->blocks.room(numbers);
  for (std::size_t k = 0; k < m; ++k)
    stream.upload(now[k].blocks().data(), now[k].blocks().size(), blocks + units[k].first);
  stream.upload(units.data(), m, work->units.room(m));
  stream.upload(columns.data(), columns.size(), work->x.room(columns.size()));
  launch(stream,
         dim3(blocks_of(static_cast<std::int64_t>(count), Predict::kThreads), static_cast<unsigned>(m)),
         Predict{at_, work->units.data(), blocks, work->x.data(), count, work->mean.room(said.size())});
  stream.download(work->mean.data(), said.size(), said.data());
  stream.wait();
  LwprScratch scratch;
  for (std::size_t k = 0; k < m; ++k)
    for (std::size_t i = 0; i < count; ++i) {
      const double value = said[k * count + i];
      mean[i * m + k] =
          (std::isnan(value) ? now[k].predict(rows.data() + i * row, &scratch) : value) * norm_out_[k];
    }
}

}  // namespace sdftrack::lwpr
