// SPDX-License-Identifier: MIT
#include "superpixels/connect.h"

#include <algorithm>
#include <numeric>
#include <utility>

#include "base/isa.h"

namespace sdftrack {

namespace {

std::size_t at(int i) { return static_cast<std::size_t>(i); }

const RunOps& ops() { return for_isa<RunOps>(used_isa()); }

}  // namespace

void Connect::begin(int width, const std::vector<int>* y_begin, bool masked, int* parent, int* best) {
  y_begin_ = y_begin, masked_ = masked;
  const int height = y_begin->back(), words = (width + 63) / 64;
  begins_.resize(at(height) * at(words)), marks_.resize(begins_.size());
  first_.resize(at(height) + 1), counted_.resize(y_begin->size() - 1);
  table_ = {width, height, words, begins_.data(), marks_.data(), first_.data(), parent, best};
}

std::size_t Connect::bytes() const {
  return sizeof(std::uint64_t) * (begins_.capacity() + marks_.capacity()) +
         sizeof(int) * (first_.capacity() + counted_.capacity());
}

template <class Work>
void Connect::each_row(Phases* phases, const Work& work) {
  phases->each([&](int band) {
    int sum = 0;
    for (int y = band_begin(band); y < band_begin(band + 1); ++y) sum += work(y);
    counted_[at(band)] = sum;
  });
}

void Connect::find_runs(Phases* phases, const std::uint8_t* codes) {
  const auto row = [&](int y) { return codes + static_cast<std::ptrdiff_t>(y) * table_.width; };
  each_row(phases, [&](int y) { return first_[at(y) + 1] = ops().mark(table_, y, row(y), masked_); });
  phases->once([&] {
    first_[0] = 0;
    std::partial_sum(first_.begin(), first_.end(), first_.begin());
  });
  phases->each([&](int band) {
    for (int y = band_begin(band); y < band_begin(band + 1); ++y) {
      ops().start(table_, y, row(y), masked_);
      if (y > band_begin(band)) ops().join(table_, y);
    }
  });
}

void Connect::join(Phases* phases, std::int64_t min_size) {
  phases->once([&] {
    for (std::size_t band = 1; band < counted_.size(); ++band) ops().join(table_, (*y_begin_)[band]);
  });
  each_row(phases, [&](int y) { return ops().find_small(table_, y, min_size); });
  while (true) {
    phases->once(
        [&] { again_ = std::any_of(counted_.begin(), counted_.end(), [](int n) { return n > 0; }); });
    if (!again_) break;
    each_row(phases, [&](int y) { return ops().choose(table_, y), 0; });
    phases->once([&] {
      again_ = false;  // nothing but small regions without a neighbour
      for (int y = 0; y < table_.height; ++y) again_ |= ops().join_choices(table_, y);
    });
    if (!again_) break;
    each_row(phases, [&](int y) { return ops().keep_small(table_, y, min_size); });
  }
  number_roots(phases);
}

void Connect::number_roots(Phases* phases) {
  int* const parent = table_.parent;
  const auto is_root = [](int p) { return (p < 0) & (p != kNobody); };  // no branch: there is no guessing it
  phases->each([&](int band) {
    const int end = first_[at(band_begin(band + 1))];
    int roots = 0;
    for (int run = first_[at(band_begin(band))]; run < end; ++run) roots += is_root(parent[run]);
    counted_[at(band)] = roots;
  });
  phases->once([&] {
    regions_ = 0;
    for (int& n : counted_) regions_ += std::exchange(n, regions_);
  });
  phases->each([&](int band) {
    const int end = first_[at(band_begin(band + 1))];
    int next = counted_[at(band)];
    for (int run = first_[at(band_begin(band))]; run < end; ++run) {
      const bool root = is_root(parent[run]);
      parent[run] = root ? -1 - next : parent[run];
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

}  // namespace sdftrack
