// SPDX-License-Identifier: MIT
// One label for one connected region (4 neighbours), small regions given to a neighbour; by union-find over
// runs, pieces of rows with one centre. No recursion, and nothing hangs on an order:
//
//   while some region is smaller than the smallest allowed and has a neighbour:
//     each such region chooses its largest neighbour (of equals the one that comes first in the image);
//     each is joined with its choice, all at once
//
// then numbers in the order of the image.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace sdftrack {

class Connect {
 public:
  // The runs of all rows, one after another: first pixel of each and one past the last, its centre (< 0:
  // outside the mask), the first run of each row and one more. Borrowed, until write() is done; `center` only
  // until then.
  // `spare`: memory that may be used meanwhile, where it is enough.
  void begin(int height, int width, const int* start, const int* center, std::vector<int> row,
             std::span<int> spare);
  int runs() const { return static_cast<int>(parent_.size()); }
  int first_run(int y) const { return row_[static_cast<std::size_t>(y)]; }

  // Joins what touches between row y and the one above; on several threads if each has rows of its own.
  void join_rows(int y);
  // After all rows: joins what is smaller than min_size, and numbers. Returns the number of regions.
  int finish(std::int64_t min_size);
  // Without connectivity: the centres that have pixels are numbered in their order.
  int number_centers(int centers);
  // The label of each pixel of rows begin..end - 1; 0 outside the mask.
  void write(int begin, int end, int first_label, int* labels) const;

  std::size_t bytes() const;

 private:
  struct Choice {
    int root, size, best;
  };
  int root(int run);
  void absorb(std::int64_t min_size);
  void choose(const std::vector<int>& small);
  bool join_choices();
  template <class Visit>
  void each_neighbor(int run, const Visit& visit) const;
  int run_end(int run) const { return start_[run + 1]; }

  int height_ = 0, width_ = 0;
  const int* start_ = nullptr;
  const int* center_ = nullptr;
  std::vector<int> row_;
  std::vector<int> parent_;                  // never a later run; afterwards the label, from 0, or -1
  std::vector<int> size_;                    // of roots
  int *above_ = nullptr, *below_ = nullptr;  // the first run that touches, in the rows above and below
  std::vector<int> own_;                     // where these are if there is nothing spare
  std::vector<int> small_;
  std::vector<Choice> choices_;
};

}  // namespace sdftrack
