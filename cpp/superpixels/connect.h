// SPDX-License-Identifier: MIT
// One label for one connected region (4 neighbours), small regions given to a neighbour; by union-find over
// runs, pieces of rows with one centre. No recursion, and nothing hangs on an order:
//
//   while some region is smaller than the smallest allowed and has a neighbour:
//     each such region chooses its largest neighbour (of equals the one that comes first in the image);
//     each is joined with its choice, all at once
//
// then numbers in the order of the image. Rows are done in bands, on any number of threads.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "superpixels/phases.h"
#include "superpixels/run_ops.h"

namespace sdftrack {

class Connect {
 public:
  // y_begin: rows of bands, and one more. Memory for a number for each pixel, borrowed until write():
  // `parent`, which stays as it is, and `best`, which may be where the labels will be.
  void begin(int width, const std::vector<int>* y_begin, bool masked, int* parent, int* best);

  // Each called by all threads together. `codes`: of all pixels, rows without gaps; see RunOps::mark.
  void find_runs(Phases* phases, const std::uint8_t* codes);
  void join(Phases* phases, std::int64_t min_size);
  void write(Phases* phases, int first_label, int* labels);

  // In place of join(): the numbers of centres, of which some have pixels; center_of(x, y).
  template <class CenterOf>
  void take_centers(int centers, const CenterOf& center_of);

  int regions() const { return regions_; }  // after join() or take_centers()
  std::size_t bytes() const;

 private:
  int band_begin(int band) const { return (*y_begin_)[static_cast<std::size_t>(band)]; }
  template <class Work, class Then>
  void each_row(Phases* phases, const Work& work, const Then& then);
  void join_choices(Phases* phases);
  void number_roots(Phases* phases);

  const std::vector<int>* y_begin_ = nullptr;
  RunTable table_;
  bool masked_ = false;
  std::atomic<bool> again_{false};
  int regions_ = 0;
  std::vector<std::uint64_t> begins_, marks_, roots_;
  std::vector<int> first_;
  std::vector<int> counted_;  // of each band
};

template <class CenterOf>
void Connect::take_centers(int centers, const CenterOf& center_of) {
  std::vector<int> number(static_cast<std::size_t>(centers), -1);
  const auto each = [&](const auto& visit) {
    for (int y = 0; y < table_.height; ++y) {
      int run = table_.first[y] - 1;
      for (int x = 0; x < table_.width; ++x)
        if (table_.row_begins(y)[x / 64] >> x % 64 & 1) visit(++run, center_of(x, y));
    }
  };
  each([&](int, int center) {
    if (center >= 0) number[static_cast<std::size_t>(center)] = 0;
  });
  regions_ = 0;
  for (int& n : number)
    if (n == 0) n = regions_++;
  each([&](int run, int center) {
    table_.parent[run] = center < 0 ? kNobody : kNumberZero - number[static_cast<std::size_t>(center)];
  });
}

}  // namespace sdftrack
