// SPDX-License-Identifier: MIT
// Predictions of many samples on the GPU: one thread per sample and output evaluates all fields of the
// output. Formulas (field_terms.h) and order of summation are the CPU's, so results are bitwise equal.
#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "base/device_pool.h"
#include "base/launch.cuh"
#include "lwpr/exponential.h"
#include "lwpr/field_terms.h"
#include "lwpr/model.h"

namespace sdftrack::lwpr {

namespace {

constexpr std::size_t kNumbersAtOnce = std::size_t{1} << 20;  // of inputs or outputs of a piece: 8 MB

// Numbers of one sample, `stride` apart: neighbouring threads read neighbouring numbers.
struct Column {
  const double* at;
  std::size_t stride;
  HD double operator[](int i) const { return at[std::size_t(i) * stride]; }
};

struct UnitOnDevice {
  std::size_t first;  // of its blocks
  int fields;
  double q_max;
};

// The flags that the host checks at the end.
struct Flags {
  int not_finite = 0, not_predicted = 0;
};

// Scales the samples to the units of the model, column by column.
struct ScaleSamples {
  static constexpr const char* kName = "LWPR samples";
  static constexpr int kThreads = 128;
  const double *x, *norm;
  std::size_t count;
  int n;
  double* columns;
  Flags* flags;

  __device__ void operator()() const {
    const std::size_t i = std::size_t(blockIdx.x) * kThreads + threadIdx.x;
    if (i >= count) return;
    bool finite = true;
    for (int j = 0; j < n; ++j) {
      const double value = x[i * std::size_t(n) + std::size_t(j)];
      finite = finite && value - value == 0 && fabs(value) <= kMaxSize * norm[j];
      columns[std::size_t(j) * count + i] = value / norm[j];
    }
    if (!finite) atomicOr(&flags->not_finite, 1);
  }
};

// A row of blocks for each output. NaN where no ready field is active: the host predicts there.
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
    const std::size_t i = std::size_t(blockIdx.x) * kThreads + threadIdx.x;
    if (i >= count) return;
    const UnitOnDevice unit = units[blockIdx.y];
    const Column sample{x + i, count};
    double w_sum = 0, wy = 0;
    for (int k = 0; k < unit.fields; ++k) {
      const LanesAt<double> read{blocks + unit.first + std::size_t(k / kFieldLanes) * at.block_size() +
                                 k % kFieldLanes};
      const double q = field_distance2<0>(at, read, sample);
      if (!(q < unit.q_max)) continue;
      const double w = exp_of<long long>(-0.5 * q) * read(at.ready());
      w_sum += w;
      wy += w * field_value<0>(at, read, sample);
    }
    mean[i * gridDim.y + blockIdx.y] = w_sum > 0 ? wy / w_sum * norm_out[blockIdx.y] : nan("");
    if (!(w_sum > 0)) atomicOr(&flags->not_predicted, 1);
  }
};

// The model on the device, for all samples of a call.
struct Work {
  DeviceStream stream;
  std::vector<UnitOnDevice> units_here;  // until the upload is done
  DeviceBuffer<UnitOnDevice> units;
  DeviceBuffer<double> blocks, norms;

  // Samples on the device, and their means; while one lane computes, the host copies for the other.
  struct Lane {
    DeviceStream stream;
    PinnedBuffer<double> x_here, mean_here;
    PinnedBuffer<Flags> flags_here{1};
    DeviceBuffer<Flags> flags{1};
    DeviceBuffer<double> x, columns, mean;
    double* to = nullptr;  // where the host wants the result in progress
    std::size_t numbers = 0;
  };
  Lane lanes[2];
};

struct Model {
  FieldLayout at;
  int outputs;
  const double* norm_out;
};

Model queue_model(Work* work, const FieldLayout& at, const std::vector<LwprUnit>& units,
                  const std::vector<double>& norm_in, const std::vector<double>& norm_out) {
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
  return {at, int(m), norms + n};
}

// Queues the computation of the samples' means, (count, outputs), in the caller's units.
void queue_means(Work* work, Work::Lane* lane, const Model& model, const double* x, std::size_t count,
                 double* mean) {
  const auto n = std::size_t(model.at.n);
  const DeviceStream& stream = lane->stream;
  stream.fill_zero(lane->flags.data(), 1);
  const unsigned rows = blocks_of(static_cast<std::int64_t>(count), Predict::kThreads);
  launch(stream, rows,
         ScaleSamples{x, work->norms.data(), count, model.at.n, lane->columns.room(n * count),
                      lane->flags.data()});
  launch(stream, dim3(rows, static_cast<unsigned>(model.outputs)),
         Predict{model.at, work->units.data(), work->blocks.data(), lane->columns.data(), model.norm_out,
                 count, mean, lane->flags.data()});
  stream.download(lane->flags.data(), 1, lane->flags_here.data());
}

// Waits for the lane's last work, copies its result out, and returns the kernels' flags.
Flags finish(Work::Lane* lane) {
  lane->stream.wait();
  if (!lane->to) return {};
  std::copy_n(lane->mean_here.data(), lane->numbers, std::exchange(lane->to, nullptr));
  return *lane->flags_here.data();
}

}  // namespace

// Piece by piece in two lanes, through pinned memory, which lets copies overlap with kernels.
void LwprModel::predict_cuda(const double* x, std::size_t count, int device, double* mean,
                             std::size_t at_once) const {
  if (count == 0) return;
  const std::size_t n = norm_in_.size(), m = norm_out_.size();
  const std::size_t most =
      std::min(count, std::max<std::size_t>(1, std::min(at_once, kNumbersAtOnce / std::max(n, m))));
  const auto work = pool_of<Work>().borrow(device);
  const StreamWaiter first(work->lanes[0].stream), second(work->lanes[1].stream);  // also after an exception
  for (Work::Lane& lane : work->lanes) lane.to = nullptr;
  const Model model = queue_model(&*work, at_, units(), norm_in_, norm_out_);
  for (const Work::Lane& lane : work->lanes)
    lane.stream.follow(reinterpret_cast<std::uintptr_t>(work->stream.get()));
  Flags all;
  const auto finish_lane = [&all](Work::Lane* lane) {
    const Flags flags = finish(lane);
    all.not_finite |= flags.not_finite, all.not_predicted |= flags.not_predicted;
  };
  std::size_t turn = 0;
  for (std::size_t done = 0; done < count; done += most, ++turn) {
    const std::size_t some = std::min(most, count - done);
    Work::Lane& lane = work->lanes[turn % 2];
    finish_lane(&lane);
    double* const here = lane.x_here.room(n * most);
    std::copy_n(x + done * n, n * some, here);
    lane.stream.upload(here, n * some, lane.x.room(n * most));
    queue_means(&*work, &lane, model, lane.x.data(), some, lane.mean.room(m * most));
    lane.stream.download(lane.mean.data(), m * some, lane.mean_here.room(m * most));
    lane.to = mean + done * m, lane.numbers = m * some;
  }
  for (std::size_t k = 0; k < 2; ++k) finish_lane(&work->lanes[(turn + k) % 2]);
  if (all.not_finite) scaled_rows(x, count, "x");  // throws, naming the sample
  if (all.not_predicted) predict_the_rest(x, count, mean);
}

DeviceArray LwprModel::predict_there(const ForeignArray& x, std::size_t count, int device) const {
  const std::size_t inputs = count * norm_in_.size(), outputs = count * norm_out_.size();
  DeviceArray mean(device, outputs * sizeof(double));
  if (count == 0) return mean;
  const auto work = pool_of<Work>().borrow(device);
  Work::Lane& lane = work->lanes[0];
  const DeviceStream& stream = lane.stream;
  const StreamWaiter at_the_end(stream);
  lane.to = nullptr;
  const Model model = queue_model(&*work, at_, units(), norm_in_, norm_out_);
  stream.follow(reinterpret_cast<std::uintptr_t>(work->stream.get()));
  stream.follow(x.stream);
  const auto* const there = static_cast<const double*>(x.data);
  auto* const means = static_cast<double*>(mean.data());
  queue_means(&*work, &lane, model, there, count, means);
  stream.wait();
  const Flags flags = *lane.flags_here.data();
  if (flags.not_finite || flags.not_predicted) {
    std::vector<double> here(inputs), predicted(outputs);
    stream.download(there, inputs, here.data());
    stream.download(means, outputs, predicted.data());
    stream.wait();
    if (flags.not_finite) scaled_rows(here.data(), count, "x");
    predict_the_rest(here.data(), count, predicted.data());
    stream.upload(predicted.data(), outputs, means);
    stream.wait();
  }
  mean.written_on(stream.get());
  return mean;
}

// Predicts on the host where no field on the device was active.
void LwprModel::predict_the_rest(const double* x, std::size_t count, double* mean) const {
  const std::size_t n = norm_in_.size(), m = norm_out_.size();
  const std::vector<LwprUnit>& now = units();
  LwprScratch scratch;
  for (std::size_t i = 0; i < count; ++i)
    for (std::size_t k = 0; k < m; ++k)
      if (std::isnan(mean[i * m + k]))
        mean[i * m + k] = now[k].predict(scaled_rows(x + i * n, 1, "x").data(), &scratch) * norm_out_[k];
}

}  // namespace sdftrack::lwpr
