// SPDX-License-Identifier: MIT
// Small regions are given to a neighbour (connect.h); for the instruction set of the file that includes this.
#pragma once

#include <climits>

#include "superpixels/run_join.h"

namespace sdftrack::superpixels {
namespace {

HD Bits all_if(bool yes) { return Bits{0} - static_cast<Bits>(yes); }
// Whether a root holds less than min_size, which is at least 1; false for kNobody.
HD bool is_small(int held, int min_size) {
  const unsigned more_than_one = static_cast<unsigned>(kNumberZero - held);
  return more_than_one < static_cast<unsigned>(min_size) - 1u;
}

// kAgain: only the marked runs. The others need not be led to their roots again: a region that is still small
// had only small neighbours, or had chosen a large one.
template <bool kAgain>
int mark_small(RunTable t, int y, int min_size) {
  const Bits* const begins = t.row_begins(y);
  Bits *const marks = t.row_marks(y), *const roots = t.row_roots(y);
  int before = t.first[y] - 1, found = 0;
  for (int w = 0; w < t.words; before += count(begins[w++])) {
    Bits small = 0, small_roots = 0;
    int run = before;
    for (Bits left = kAgain ? marks[w] : begins[w]; left != 0; left &= left - 1) {
      run = kAgain ? before + count(begins[w] & (left ^ (left - 1))) : run + 1;
      const int root = root_in_order(t.parent, run);
      const int held = get(t.parent, root);
      set(t.parent, run, root == run ? held : root);
      t.best[run] = -1;
      const Bits bit = (left & -left) & all_if(is_small(held, min_size));
      small |= bit, small_roots |= bit & all_if(root == run);
    }
    marks[w] = small, roots[w] = small_roots;
    found += count(small);
  }
  return found;
}
int find_small_in_row(RunTable t, int y, int min_size, bool again) {
  return again ? mark_small<true>(t, y, min_size) : mark_small<false>(t, y, min_size);
}

// Rank of a region as a neighbour, the lowest number for the best: larger regions first; of equals the first
// in the image. kNobody is the worst.
using Worth = std::int64_t;
constexpr Worth kWorst = Worth{kNobody} << 32;
HD Worth worth(const RunTable& t, int root) {
  return static_cast<Worth>(get(t.parent, root)) << 32 | static_cast<Worth>(root);
}
// Marks the absence of a choice, if `none`, by the sign; without a branch, because it cannot be predicted.
HD Worth unless(bool none, Worth worth) {
  return static_cast<Worth>(static_cast<Bits>(worth) + (static_cast<Bits>(none) << 63));
}

// Other rows of the region make offers too: their order does not matter, but one thread must make them all.
HD void offer(const RunTable& t, int own, Worth best) {
  const int chosen = get(t.best, own);
  const Worth before = unless(chosen < 0, worth(t, std::max(chosen, 0)));
  set(t.best, own, int(std::min(best, before) & INT_MAX));
}

bool choose_row(RunTable t, int y, int from, int until) {
  bool found = false;
  const Bits *const begins = t.row_begins(y), *const marks = t.row_marks(y);
  const bool top = y == 0, bottom = y + 1 == t.height;
  int before = t.first[y] - 1, above = top ? 0 : t.first[y - 1] - 1, below = bottom ? 0 : t.first[y + 1] - 1;
  for (int w = 0; w < t.words; ++w) {
    for (Bits left = marks[w]; left != 0; left &= left - 1) {
      const int x = 64 * w + lowest(left), end = run_end(t, begins, x);
      const int run = before + count(begins[w] & up_to(x % 64));
      const int own = next_root(t.parent, run);
      if (own < from || own >= until) continue;
      found = true;
      Worth best = kWorst;
      const auto tell = [&](int other) SLIC_INLINE {
        const int root = next_root(t.parent, other);
        best = std::min(best, unless(root == own, worth(t, root)));
      };
      if (x > 0) tell(run - 1);
      if (end < t.width) tell(run + 1);
      if (!top) each_beside(t, y - 1, above, x, end, tell);
      if (!bottom) each_beside(t, y + 1, below, x, end, tell);
      if (best < kWorst) offer(t, own, best);
    }
    before += count(begins[w]);
    if (!top) above += count(t.row_begins(y - 1)[w]);
    if (!bottom) below += count(t.row_begins(y + 1)[w]);
  }
  return found;
}

bool join_choices_of_row(RunTable t, int y, int from, int until) {
  const Bits* const begins = t.row_begins(y);
  Bits* const roots = t.row_roots(y);
  int before = t.first[y] - 1;
  bool joined = false;
  for (int w = 0; w < t.words; before += count(begins[w++]))
    for (Bits left = roots[w]; left != 0; left &= left - 1) {
      const int run = before + count(begins[w] & (left ^ (left - 1))), choice = t.best[run];
      if (choice < from || choice >= until) continue;
      joined |= unite(t.parent, run, choice);
      roots[w] &= ~(left & -left);
    }
  return joined;
}

}  // namespace
}  // namespace sdftrack::superpixels
