// SPDX-License-Identifier: MIT
// Runs: pieces of rows with one centre. A bit for each pixel tells where they begin, so that the number of a
// run follows from counting bits, and only one number is stored for each. Loops over them are compiled once
// per instruction set (row_ops.h), because of the bit counting.
#pragma once

#include <cstdint>

namespace sdftrack::superpixels {

// Value of a root: ~(pixels of its region). A region outside the mask counts no pixels.
constexpr int kNobody = ~0;
// Final value of a root: this minus the region's number.
constexpr int kNumberZero = kNobody - 1;

struct RunTable {
  int width = 0, height = 0, words = 0;  // of 64 pixels, in a row
  std::uint64_t* begins = nullptr;       // rows of `words`; a bit where a run begins
  std::uint64_t* marks = nullptr;  // where the row above has the same centre; later: runs of small regions
  std::uint64_t* roots = nullptr;  // those roots of small regions that have not been joined with their choice
  const int* first = nullptr;      // the first run of each row, and one more
  int* parent = nullptr;  // >= 0: an earlier run of the region. A root, which is the first, has ~(its
                          // region's pixels), and in the end kNumberZero - the region's number
  int* best = nullptr;    // of the root of a small region: its choice, or -1

  const std::uint64_t* row_begins(int y) const { return begins + y * words; }
  std::uint64_t* row_roots(int y) const { return roots + y * words; }
  std::uint64_t* row_marks(int y) const { return marks + y * words; }
};

// The table is passed by value, so that the compiler knows that no write changes its members.
struct RunOps {
  // Marks the bits of row y and returns the number of its runs. `codes`: of the row; the row above lies
  // before it (y > 0). 64 bytes on either side can be read.
  int (*mark)(RunTable, int y, const std::uint8_t* codes, bool masked);
  void (*start)(RunTable, int y, const std::uint8_t* codes, bool masked);
  // Joins what touches between row y and the one above; in parallel if each thread has rows of its own.
  void (*join)(RunTable, int y);
  // Leads runs of row y to their roots and marks those in regions smaller than min_size: among all runs or,
  // with `again`, among the marked ones. Returns their number.
  int (*find_small)(RunTable, int y, int min_size, bool again);
  // Offers the small regions of row y their neighbours there, for roots in from..until - 1; the others belong
  // to another thread. Returns whether there are any.
  bool (*choose)(RunTable, int y, int from, int until);
  // Joins the small regions with roots in row y with their choices, if these are in from..until - 1. Returns
  // whether there was any to join.
  bool (*join_choices)(RunTable, int y, int from, int until);
  // Writes the label of each pixel of row y, 0 outside the mask. A run shorter than 16 is written 16 long,
  // except at the last pixels of rows with `last`: later writes correct what lies behind.
  void (*write)(RunTable, int y, int first_label, bool last, int* labels);

  static const RunOps baseline, avx2, avx512;
};

}  // namespace sdftrack::superpixels
