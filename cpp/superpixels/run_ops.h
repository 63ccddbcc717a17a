// SPDX-License-Identifier: MIT
// Runs: pieces of rows with one centre. A bit for each pixel says where they begin, so that the number of a
// run follows from counting bits, and nothing but one number is kept for each. Loops over them are compiled
// once per instruction set (row_ops.h), for the sake of counting.
#pragma once

#include <cstddef>
#include <cstdint>

namespace sdftrack::superpixels {

// What a root holds: ~(pixels of its region). Of what is outside the mask that is a region of none.
constexpr int kNobody = ~0;
// In the end: this less the region's number.
constexpr int kNumberZero = kNobody - 1;

struct RunTable {
  int width = 0, height = 0, words = 0;  // of 64 pixels, in a row
  std::uint64_t* begins = nullptr;       // rows of `words`; a bit where a run begins
  std::uint64_t* marks = nullptr;  // where the row above has the same centre; later: runs of small regions
  std::uint64_t* roots = nullptr;  // of these the roots that have not been joined with their choice
  const int* first = nullptr;      // the first run of each row, and one more
  int* parent = nullptr;  // >= 0: an earlier run of the region. A root, which is the first, has ~(its
                          // region's pixels), and in the end kNumberZero - the region's number
  int* best = nullptr;    // of the root of a small region: its choice, or -1

  const std::uint64_t* row_begins(int y) const { return begins + static_cast<std::ptrdiff_t>(y) * words; }
  std::uint64_t* row_roots(int y) const { return roots + static_cast<std::ptrdiff_t>(y) * words; }
  std::uint64_t* row_marks(int y) const { return marks + static_cast<std::ptrdiff_t>(y) * words; }
};

// The table by value: what is written is known not to be its numbers.
struct RunOps {
  // Bits of row y and the number of its runs. `codes`: of the row; that above lies before it (y > 0). 64
  // bytes on either side can be read.
  int (*mark)(RunTable, int y, const std::uint8_t* codes, bool masked);
  // Each run of row y a region of its own.
  void (*start)(RunTable, int y, const std::uint8_t* codes, bool masked);
  // Joins what touches between row y and the one above; on several threads if each has rows of its own.
  void (*join)(RunTable, int y);
  // Leads runs of row y to their roots and marks those whose region is smaller than min_size, of all or,
  // again, of those that are marked already; returns how many they are.
  int (*find_small)(RunTable, int y, int min_size, bool again);
  // Tells the small regions of row y of the neighbours that they have there, those with roots in from..until
  // - 1: the others are another thread's. Whether there are any.
  bool (*choose)(RunTable, int y, int from, int until);
  // Joins the small regions with roots in row y with their choices, as far as these are in from..until - 1;
  // whether there was any to join.
  bool (*join_choices)(RunTable, int y, int from, int until);
  // The label of each pixel of row y, 0 outside the mask. A run shorter than 16 is written 16 long, but for
  // the last pixels of rows that say so: what lies behind is written later.
  void (*write)(RunTable, int y, int first_label, bool last, int* labels);

  static const RunOps baseline, avx2, avx512;
};

}  // namespace sdftrack::superpixels
