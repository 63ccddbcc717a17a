// SPDX-License-Identifier: MIT
// One label per connected region (4 neighbours), with small regions given to a neighbour: union-find over
// runs, pieces of rows with one centre. There is no recursion, and the result does not depend on an order:
//
//   while some region is smaller than the smallest allowed and has a neighbour:
//     each such region chooses its largest neighbour (of equals the one that comes first in the image);
//     each is joined with its choice, all at once
//
// then the regions are numbered in the order of the image. Rows are done in bands, on any number of threads.
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "superpixels/phases.h"
#include "superpixels/run_ops.h"

namespace sdftrack::superpixels {

class Connect {
 public:
  // y_begin: first rows of the bands, and the end. Memory for a number for each pixel, borrowed until
  // write(): `parent`, which write() leaves unchanged, and `best`, which may be the memory of the labels.
  void begin(int width, const std::vector<int>* y_begin, bool masked, int* parent, int* best);

  // `codes`: for all pixels, rows without gaps; see RunOps::mark.
  void find_runs(Phases* phases, const std::uint8_t* codes);
  void join(Phases* phases, const std::uint8_t* codes, std::int64_t min_size);
  void write(Phases* phases, int first_label, int* labels);

  // In place of join(): takes center_of(x, y), the numbers of centres, some of which have pixels.
  template <class CenterOf>
  void take_centers(Phases* phases, int centers, const CenterOf& center_of);

  int regions() const { return regions_; }  // after join() or take_centers()
  std::size_t bytes() const;

 private:
  int band_begin(int band) const { return (*y_begin_)[band]; }
  template <class Work>
  void each_row(Phases* phases, const Work& work);
  void join_touching(Phases* phases, const std::uint8_t* codes);
  bool join_choices(Phases* phases);
  void number_roots(Phases* phases);

  const std::vector<int>* y_begin_ = nullptr;
  RunTable table_;
  bool masked_ = false;
  int regions_ = 0;
  std::vector<std::uint64_t> begins_, marks_, roots_;
  std::vector<int> first_;
  std::vector<int> counted_;  // of each band
  std::vector<int> number_;   // of each centre, where centres are taken
};

// Sums of work(row) for each band.
template <class Work>
void Connect::each_row(Phases* phases, const Work& work) {
  const auto band_sum = [&](int band) {
    int sum = 0;
    for (int y = band_begin(band); y < band_begin(band + 1); ++y) sum += work(y);
    counted_[band] = sum;
  };
  phases->each(band_sum);
}

template <class CenterOf>
void Connect::take_centers(Phases* phases, int centers, const CenterOf& center_of) {
  int* const centre_of_run = table_.parent;
  const auto look_up = [&](int y) {
    const std::uint64_t* const begins = table_.row_begins(y);
    int run = table_.first[y];
    for (int word = 0; word < table_.words; ++word)
      for (std::uint64_t bits = begins[word]; bits; bits &= bits - 1)
        centre_of_run[run++] = center_of(64 * word + std::countr_zero(bits), y);
    return 0;
  };
  each_row(phases, look_up);
  const int runs = table_.first[table_.height];
  number_.assign(centers, 0);
  for (int run = 0; run < runs; ++run)
    if (centre_of_run[run] >= 0) number_[centre_of_run[run]] = 1;
  regions_ = 0;
  for (int& n : number_) regions_ += std::exchange(n, regions_);
  phases->each([&](int band) {
    const int end = table_.first[band_begin(band + 1)];
    for (int run = table_.first[band_begin(band)]; run < end; ++run) {
      const int centre = centre_of_run[run];
      centre_of_run[run] = centre < 0 ? kNobody : kNumberZero - number_[centre];
    }
  });
}

}  // namespace sdftrack::superpixels
