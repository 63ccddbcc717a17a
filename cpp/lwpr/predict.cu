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

// What the host looks at when it is done.
struct Flags {
  int not_finite = 0, not_said = 0;
};

// The samples in the units of the model, column by column.
struct ScaleSamples {
  static constexpr const char* kName = "LWPR samples";
  static constexpr int kThreads = 128;
  const double *x, *norm;
  std::size_t count;
  int n;
  double* columns;
  Flags* flags;

  __device__ void operator()() const {
    const std::size_t i = static_cast<std::size_t>(blockIdx.x) * kThreads + threadIdx.x;
    if (i >= count) return;
    bool finite = true;
    for (int j = 0; j < n; ++j) {
      const double value = x[i * static_cast<std::size_t>(n) + static_cast<std::size_t>(j)];
      finite = finite && value - value == 0 && fabs(value) <= kMaxSize * norm[j];
      columns[static_cast<std::size_t>(j) * count + i] = value / norm[j];
    }
    if (!finite) atomicOr(&flags->not_finite, 1);
  }
};

// A row of blocks for each output. NaN where no field that is ready is active: the host knows what to say
// there.
struct Predict {
  static constexpr const char* kName = "LWPR prediction";
  static constexpr int kThreads = 128;
  FieldLayout at;
  const UnitOnDevice* units;
  const double *blocks, *x, *norm_out;
  std::size_t count;
  double* mean;
  Flags* flags;

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
    mean[i * gridDim.y + blockIdx.y] = w_sum > 0 ? wy / w_sum * norm_out[blockIdx.y] : nan("");
    if (!(w_sum > 0)) atomicOr(&flags->not_said, 1);
  }
};

struct Work {
  DeviceStream stream;
  PinnedBuffer<Flags> flags_here{1};
  std::vector<UnitOnDevice> units_here;  // until the upload is done
  DeviceBuffer<Flags> flags{1};
  DeviceBuffer<UnitOnDevice> units;
  DeviceBuffer<double> blocks, norms, x, columns, mean;
};

// Queued: the samples' means, (count, outputs), in the units of the caller.
void queue_means(Work* work, const FieldLayout& at, const std::vector<LwprUnit>& units,
                 const std::vector<double>& norm_in, const std::vector<double>& norm_out, const double* x,
                 std::size_t count, double* mean) {
  const std::size_t n = norm_in.size(), m = norm_out.size();
  const DeviceStream& stream = work->stream;
  std::vector<UnitOnDevice>& there = work->units_here;
  there.clear();
  std::size_t numbers = 0;
  for (const LwprUnit& unit : units) {
    there.push_back({numbers, unit.size(), unit.q_max()});
    numbers += unit.blocks().size();
  }
  double *const blocks = work->blocks.room(numbers), *const norms = work->norms.room(n + m);
  for (std::size_t k = 0; k < m; ++k)
    stream.upload(units[k].blocks().data(), units[k].blocks().size(), blocks + there[k].first);
  stream.upload(there.data(), m, work->units.room(m));
  stream.upload(norm_in.data(), n, norms);
  stream.upload(norm_out.data(), m, norms + n);
  stream.fill_zero(work->flags.data(), 1);
  const unsigned rows = blocks_of(static_cast<std::int64_t>(count), Predict::kThreads);
  launch(stream, rows,
         ScaleSamples{x, norms, count, at.n, work->columns.room(n * count), work->flags.data()});
  launch(stream, dim3(rows, static_cast<unsigned>(m)),
         Predict{at, work->units.data(), blocks, work->columns.data(), norms + n, count, mean,
                 work->flags.data()});
  stream.download(work->flags.data(), 1, work->flags_here.data());
}

}  // namespace

void LwprModel::predict_cuda(const double* x, std::size_t count, int device, double* mean) const {
  if (count == 0) return;
  const std::size_t inputs = count * norm_in_.size(), outputs = count * norm_out_.size();
  const auto work = pool_of<Work>().borrow(device);  // its end waits for what is read and written here
  work->stream.upload(x, inputs, work->x.room(inputs));
  queue_means(&*work, at_, units(), norm_in_, norm_out_, work->x.data(), count, work->mean.room(outputs));
  work->stream.download(work->mean.data(), outputs, mean);
  work->stream.wait();
  const Flags flags = *work->flags_here.data();
  if (flags.not_finite) scaled_rows(x, count, "x");  // throws: it knows which sample
  if (flags.not_said) say_the_rest(x, count, mean);
}

DeviceArray LwprModel::predict_there(const ForeignArray& x, std::size_t count, int device) const {
  const std::size_t inputs = count * norm_in_.size(), outputs = count * norm_out_.size();
  DeviceArray mean(device, outputs * sizeof(double));
  if (count == 0) return mean;
  const auto work = pool_of<Work>().borrow(device);
  const DeviceStream& stream = work->stream;
  stream.follow(x.stream);
  const auto* const there = static_cast<const double*>(x.data);
  auto* const means = static_cast<double*>(mean.data());
  queue_means(&*work, at_, units(), norm_in_, norm_out_, there, count, means);
  stream.wait();
  const Flags flags = *work->flags_here.data();
  if (flags.not_finite || flags.not_said) {
    std::vector<double> here(inputs), said(outputs);
    stream.download(there, inputs, here.data());
    stream.download(means, outputs, said.data());
    stream.wait();
    if (flags.not_finite) scaled_rows(here.data(), count, "x");
    say_the_rest(here.data(), count, said.data());
    stream.upload(said.data(), outputs, means);
    stream.wait();
  }
  mean.written_on(stream.get());
  return mean;
}

// What no field on the device has said.
void LwprModel::say_the_rest(const double* x, std::size_t count, double* mean) const {
  const std::size_t n = norm_in_.size(), m = norm_out_.size();
  const std::vector<LwprUnit>& now = units();
  LwprScratch scratch;
  for (std::size_t i = 0; i < count; ++i)
    for (std::size_t k = 0; k < m; ++k)
      if (std::isnan(mean[i * m + k]))
        mean[i * m + k] = now[k].predict(scaled_rows(x + i * n, 1, "x").data(), &scratch) * norm_out_[k];
}

}  // namespace sdftrack::lwpr
