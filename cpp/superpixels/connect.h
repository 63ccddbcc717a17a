// SPDX-License-Identifier: MIT
// One label for one connected region (4 neighbours), small regions given to a neighbour; by union-find over runs,
// pieces of rows with one centre. No recursion, and nothing hangs on an order:
//
//   while some region is smaller than the smallest allowed and has a neighbour:
//     each such region chooses its largest neighbour (of equals the one that comes first in the image);
//     each is joined with its choice, all at once
//
// then numbers in the order of the image.
#pragma once

#include <cstdint>
#include <vector>

namespace sdftrack {

class Connect {
 public:
  void clear(int height, int width);
  // Runs of the rows in order: call for each run from left to right. center < 0: outside the mask.
  void add(int start, int center) { start_.push_back(start), center_.push_back(center); }
  void end_row() { row_.push_back(static_cast<int>(start_.size())); }

  // Joins what touches, then what is smaller than min_size. Returns the number of regions.
  int join(std::int64_t min_size);
  // Without connectivity: the centres that have pixels are numbered in their order.
  int number_centers(int centers);
  // The label of each pixel of rows begin..end - 1; 0 outside the mask.
  void write(int begin, int end, int first_label, int* labels) const;

  std::size_t bytes() const;

 private:
  int root(int run);
  void unite(int a, int b);
  void join_rows(int y);
  void absorb(std::int64_t min_size);
  template <class Visit>
  void each_neighbor(int run, const Visit& visit) const;
  int run_end(int run) const { return start_[static_cast<std::size_t>(run) + 1]; }

  int height_ = 0, width_ = 0;
  std::vector<int> start_, center_;  // first pixel of each run, and one past the last run
  std::vector<int> row_;             // first run of each row, and one more
  std::vector<int> parent_;          // never a later run; afterwards the label, from 0
  std::vector<int> size_;            // of roots
};

}  // namespace sdftrack
