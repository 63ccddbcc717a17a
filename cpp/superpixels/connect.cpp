// SPDX-License-Identifier: MIT
#include "superpixels/connect.h"

#include <algorithm>
#include <atomic>
#include <climits>
#include <numeric>

#include "base/isa.h"

namespace sdftrack::superpixels {

namespace {

std::size_t at(int i) { return std::size_t(i); }

const RunOps& ops() { return for_isa<RunOps>(used_isa()); }

}  // namespace

void Connect::begin(int width, const std::vector<int>* y_begin, bool masked, int* parent, int* best) {
  y_begin_ = y_begin, masked_ = masked;
  const int height = y_begin->back(), words = (width + 63) / 64;
  begins_.resize(at(height) * at(words)), marks_.resize(begins_.size()), roots_.resize(begins_.size());
  first_.resize(at(height) + 1), counted_.resize(y_begin->size() - 1);
  table_ = {width, height, words, begins_.data(), marks_.data(), roots_.data(), first_.data(), parent, best};
}

std::size_t Connect::bytes() const {
  return sizeof(std::uint64_t) * (begins_.capacity() + marks_.capacity() + roots_.capacity()) +
         sizeof(int) * (first_.capacity() + counted_.capacity() + number_.capacity());
}

void Connect::find_runs(Phases* phases, const std::uint8_t* codes) {
  const auto row = [&](int y) { return codes + y * table_.width; };
  const auto mark = [&](int y) { return first_[at(y) + 1] = ops().mark(table_, y, row(y), masked_); };
  each_row(phases, mark);
  first_[0] = 0;
  std::partial_sum(first_.begin(), first_.end(), first_.begin());
}

void Connect::join_touching(Phases* phases, const std::uint8_t* codes) {
  const auto row = [&](int y) { return codes + y * table_.width; };
  const auto join_band = [&](int band) {
    for (int y = band_begin(band); y < band_begin(band + 1); ++y) {
      ops().start(table_, y, row(y), masked_);
      if (y > band_begin(band)) ops().join(table_, y);
    }
  };
  phases->each(join_band);
  for (std::size_t band = 1; band < counted_.size(); ++band) ops().join(table_, (*y_begin_)[band]);
}

void Connect::join(Phases* phases, const std::uint8_t* codes, std::int64_t least) {
  join_touching(phases, codes);
  const int min_size = int(std::clamp<std::int64_t>(least, 1, INT_MAX));
  for (bool again = false;; again = true) {
    each_row(phases, [&](int y) { return ops().find_small(table_, y, min_size, again); });
    if (std::none_of(counted_.begin(), counted_.end(), [](int n) { return n > 0; })) break;
    if (!join_choices(phases)) break;  // only small regions without a neighbour remain
  }
  number_roots(phases);
}

// A region belongs to the thread of the bands that contain its root. Returns whether any was joined.
bool Connect::join_choices(Phases* phases) {
  const auto first_run = [&](int band) { return first_[at(band_begin(band))]; };
  const auto choose = [&](int band, int band_end) {
    const int from = first_run(band), until = first_run(band_end), end = band_begin(band_end);
    bool more = true;  // continue below the share for regions that extend there
    for (int y = band_begin(band); y < table_.height && (y < end || more); ++y)
      more = ops().choose(table_, y, from, until);
  };
  phases->each_share(choose);
  std::atomic<bool> any{false};
  const auto join_within = [&](int band, int band_end) {
    const int from = first_run(band), until = first_run(band_end);
    bool joined = false;
    for (int y = band_begin(band); y < band_begin(band_end); ++y)
      joined |= ops().join_choices(table_, y, from, until);
    if (joined) any = true;
  };
  phases->each_share(join_within);
  for (int y = 0; y < table_.height; ++y)
    if (ops().join_choices(table_, y, 0, INT_MAX)) any = true;
  return any;
}

void Connect::number_roots(Phases* phases) {
  int* const parent = table_.parent;
  const auto is_root = [](int p) { return p < kNobody; };
  const auto count = [&](int band) {
    const int end = first_[at(band_begin(band + 1))];
    int roots = 0;
    for (int run = first_[at(band_begin(band))]; run < end; ++run) roots += is_root(parent[run]);
    counted_[at(band)] = roots;
  };
  phases->each(count);
  regions_ = 0;
  for (int& n : counted_) regions_ += std::exchange(n, regions_);
  phases->each([&](int band) {
    const int end = first_[at(band_begin(band + 1))];
    int next = counted_[at(band)];
    for (int run = first_[at(band_begin(band))]; run < end; ++run) {
      const bool root = is_root(parent[run]);
      parent[run] = root ? kNumberZero - next : parent[run];
      next += root;
    }
  });
}

void Connect::write(Phases* phases, int first_label, int* labels) {
  phases->each([&](int band) {
    const int end = band_begin(band + 1);
    for (int y = band_begin(band); y < end; ++y) ops().write(table_, y, first_label, y + 1 == end, labels);
  });
}

}  // namespace sdftrack::superpixels
