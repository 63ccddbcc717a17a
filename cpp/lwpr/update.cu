// SPDX-License-Identifier: MIT
// Updates on the GPU: memory and launches for update.cuh.
#include <algorithm>
#include <limits>
#include <mutex>

#include "lwpr/units_on_device.h"
#include "lwpr/update.cuh"

namespace sdftrack::lwpr {

namespace {

constexpr int kFirstFields = 64;                           // initial room
constexpr std::size_t kMaxScratch = std::size_t{1} << 25;  // numbers of working memory for parallel blocks

// All units in the layout of the device, in the host's memory.
struct Image {
  UnitRoom room;
  std::vector<Progress> progress;
  std::vector<double> blocks, records;

  Image(const FieldLayout& at, std::size_t outputs, const UnitRoom& of)
      : room(of),
        progress(outputs),
        blocks(outputs * block_numbers(at), std::numeric_limits<double>::quiet_NaN()),
        records(outputs * record_numbers(at)) {}

  std::size_t block_numbers(const FieldLayout& at) const {  // of an output
    return std::size_t(room.fields / kFieldLanes) * at.block_size();
  }
  std::size_t record_numbers(const FieldLayout& at) const {
    return std::size_t(room.fields) * std::size_t(at.record_size(room.projections));
  }
  // Stores the fields of an output, whose records lie `stride` apart.
  void put(const FieldLayout& at, std::size_t output, int fields, const double* from_blocks,
           const double* from_records, std::ptrdiff_t stride) {
    progress[output].fields = fields;
    const int size = (fields + kFieldLanes - 1) / kFieldLanes * at.block_size();
    std::copy(from_blocks, from_blocks + size, blocks.data() + output * block_numbers(at));
    double* const to = records.data() + output * record_numbers(at);
    const std::ptrdiff_t wide = at.record_size(room.projections);
    for (int k = 0; k < fields; ++k)
      std::copy(from_records + k * stride, from_records + k * stride + std::min(stride, wide), to + k * wide);
  }
};

class Units final : public UnitsOnDevice {
 public:
  Units(const FieldLayout& at, const LwprOptions& options, int device)
      : device_(device), at_(at), settings_(options), first_M_(initial_metric(options, at.n)) {}
  ~Units() override { static_cast<void>(cudaStreamSynchronize(stream_.get())); }

  int device() const override { return device_; }
  bool ahead() const override { return ahead_; }
  void forget() override { resident_ = ahead_ = false; }

  void learn(const std::vector<LwprUnit>& units, const double* rows, const double* y,
             std::size_t count) override {
    const DeviceScope scope(device_);
    try {
      if (!resident_) send(units);
      run(rows, y, static_cast<long long>(count));
    } catch (...) {
      static_cast<void>(cudaStreamSynchronize(stream_.get()));
      forget();
      throw;
    }
    for (std::size_t k = 0; k < seen_.size(); ++k)
      for (std::size_t i = 0; i < count; ++i) seen_[k].add(y[k * count + i]);
    resident_ = ahead_ = true;
  }

  void fetch(std::vector<LwprUnit>* units) override {
    const std::lock_guard lock(mutex_);
    if (!ahead_) return;
    const DeviceScope scope(device_);
    const Image now = image();
    const std::size_t n = units->size();
    for (std::size_t k = 0; k < n; ++k)
      (*units)[k].take(seen_[k], now.progress[k].fields, now.blocks.data() + k * now.block_numbers(at_),
                       now.records.data() + k * now.record_numbers(at_), at_.record_size(room_.projections));
    ahead_ = false;
  }

 private:
  void send(const std::vector<LwprUnit>& units) {
    UnitRoom room{kFirstFields, first_projections(at_)};
    for (const LwprUnit& unit : units) {
      while (room.fields <= unit.size()) room.fields *= 2;
      while (at_.record_size(room.projections) < unit.record_stride()) ++room.projections;
    }
    Image image(at_, units.size(), room);
    seen_.clear();
    for (std::size_t k = 0; k < units.size(); ++k) {
      const LwprUnit& unit = units[k];
      seen_.push_back(unit.seen());
      if (unit.size() > 0)
        image.put(at_, k, unit.size(), unit.blocks().data(), unit.record(0), unit.record_stride());
    }
    send(image);
  }

  void send(const Image& image) {
    // The caller may free the image afterwards, even if the second copy fails.
    const StreamWaiter waiter(stream_);
    room_ = image.room, progress_ = image.progress;
    stream_.upload(image.blocks.data(), image.blocks.size(), blocks_.room(image.blocks.size()));
    stream_.upload(image.records.data(), image.records.size(), records_.room(image.records.size()));
    stream_.wait();
  }

  Image image() const {
    Image out(at_, progress_.size(), room_);
    const StreamWaiter waiter(stream_);
    out.progress = progress_;
    stream_.download(blocks_.data(), out.blocks.size(), out.blocks.data());
    stream_.download(records_.data(), out.records.size(), out.records.data());
    stream_.wait();
    return out;
  }

  // Makes room for more fields or projections in each output, as one of them needs.
  void grow() {
    UnitRoom wider = room_;
    for (const Progress& one : progress_)
      if (one.wants)
        wider.projections = std::min(at_.n, 2 * room_.projections);
      else if (one.fields == room_.fields)
        wider.fields = 2 * room_.fields;
    const Image before = image();
    Image after(at_, progress_.size(), wider);
    for (std::size_t k = 0; k < progress_.size(); ++k)
      after.put(at_, k, progress_[k].fields, before.blocks.data() + k * before.block_numbers(at_),
                before.records.data() + k * before.record_numbers(at_), at_.record_size(room_.projections));
    for (std::size_t k = 0; k < progress_.size(); ++k) after.progress[k].next = progress_[k].next;
    send(after);
  }

  void run(const double* rows, const double* y, long long count) {
    const std::size_t samples = std::size_t(count), outputs = progress_.size();
    for (Progress& one : progress_) one.next = 0;
    stream_.upload(first_M_.data(), first_M_.size(), metric_.room(first_M_.size()));
    const std::size_t numbers = samples * std::size_t(at_.row);
    stream_.upload(rows, numbers, x_.room(numbers));
    stream_.upload(y, outputs * samples, y_.room(outputs * samples));
    const StreamWaiter waiter(stream_);
    for (;;) {
      stream_.upload(progress_.data(), outputs, on_device_.room(outputs));
      for_inputs(at_.n, [&](auto n) { start<n()>(count); });
      stream_.download(on_device_.data(), outputs, progress_.data());
      stream_.wait();
      if (std::all_of(progress_.begin(), progress_.end(),
                      [&](const Progress& one) { return one.next == count && !one.wants; }))
        return;
      grow();
    }
  }

  // Starts as many outputs at a time as the working memory allows.
  template <int N>
  void start(long long count) {
    using Kernel = LearnSamples<N>;
    const std::size_t each = N > 0 ? 0 : std::size_t(Kernel::kThreads) * scratch_size(at_);
    const std::size_t outputs = progress_.size(),
                      together = N > 0 ? outputs : std::clamp(kMaxScratch / each, std::size_t{1}, outputs);
    double* const scratch = scratch_.room(together * each);
    for (std::size_t first = 0; first < outputs; first += together) {
      const auto blocks = static_cast<unsigned>(std::min(together, outputs - first));
      launch(stream_, dim3(blocks),
             Kernel{at_, settings_, room_, on_device_.data(), blocks_.data(), records_.data(), scratch,
                    metric_.data(), x_.data(), y_.data(), count, static_cast<unsigned>(first)});
    }
  }

  int device_;
  FieldLayout at_;
  UnitSettings settings_;
  std::vector<double> first_M_;
  DeviceStream stream_;
  DeviceBuffer<double> blocks_, records_, scratch_, metric_, x_, y_;
  DeviceBuffer<Progress> on_device_;
  UnitRoom room_;
  std::vector<Progress> progress_;
  std::vector<OutputsSeen> seen_;
  bool resident_ = false, ahead_ = false;
  std::mutex mutex_;
};

}  // namespace

std::unique_ptr<UnitsOnDevice> units_on_device(const FieldLayout& at, const LwprOptions& options,
                                               int device) {
  const DeviceScope scope(device);
  return std::make_unique<Units>(at, options, device);
}

}  // namespace sdftrack::lwpr
