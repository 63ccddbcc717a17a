// SPDX-License-Identifier: MIT
// Joins runs that touch and have one centre into regions, and finally makes labels. Several threads find
// roots and shorten paths at once; each number is valid before and after a change: relaxed atomics.
#pragma once

#include <algorithm>
#include <atomic>

#include "superpixels/run_bits.h"

namespace sdftrack::superpixels {
namespace {

HD int get(const int* p, int run) {
  return std::atomic_ref<int>(const_cast<int&>(p[run])).load(std::memory_order_relaxed);
}
HD void set(int* p, int run, int value) {
  std::atomic_ref<int>(p[run]).store(value, std::memory_order_relaxed);
}

// One step towards the root; a root stays. A run's parent is never a later run, and as an unsigned number the
// value of a root is larger than all. Without a branch, because it cannot be predicted.
HD int next_root(const int* parent, int run) {
  return static_cast<int>(std::min(static_cast<unsigned>(run), static_cast<unsigned>(get(parent, run))));
}
// It is rarely more than one step away.
HD int root_of(const int* parent, int run) {
  run = next_root(parent, run);
  for (int up; (up = get(parent, run)) >= 0;) run = up;
  return run;
}
// Rarely more than two steps, if the runs before this one have been led to their roots.
HD int root_in_order(const int* parent, int run) { return root_of(parent, next_root(parent, run)); }

// Makes the earlier root the parent of the later one; returns whether there were two roots.
HD bool unite(int* parent, int run_a, int run_b) {
  const int a = root_of(parent, run_a), b = root_of(parent, run_b);
  if (a == b) return false;
  const int early = std::min(a, b), late = std::max(a, b);
  const int held = parent[early] + parent[late] + 1;
  parent[early] = held, parent[late] = early;
  parent[run_a] = run_a == early ? held : early;
  parent[run_b] = run_b == early ? held : early;
  return true;
}

void start_row(RunTable t, int y, const std::uint8_t* codes, bool masked) {
  each_piece(t, y, [&](int run, int x, int end) SLIC_INLINE {
    t.parent[run] = masked && codes[x] == kOutside ? kNobody : ~(end - x);
  });
}

void join_row(RunTable t, int y) {
  const Bits *const above = t.row_begins(y - 1), *const below = t.row_begins(y), *const same = t.row_marks(y);
  int a = t.first[y - 1] - 1, b = t.first[y] - 1;
  for (int w = 0; w < t.words; ++w) {
    // One pixel of each two runs that touch.
    for (Bits left = same[w] & (above[w] | below[w]); left != 0; left &= left - 1) {
      const Bits up = left ^ (left - 1);  // to the lowest bit
      unite(t.parent, a + count(above[w] & up), b + count(below[w] & up));
    }
    a += count(above[w]), b += count(below[w]);
  }
}

void write_row(RunTable t, int y, int first_label, bool last, int* labels) {
  constexpr int kAtOnce = 16;
  int* const row = labels + static_cast<std::ptrdiff_t>(y) * t.width;
  const int stop = last || t.width < kAtOnce ? t.width - kAtOnce : t.width;
  each_piece(t, y, [&](int run, int x, int end) SLIC_INLINE {
    const int root = t.parent[root_in_order(t.parent, run)];
    const int label = root == kNobody ? 0 : first_label + (kNumberZero - root);
    int some[kAtOnce];
    for (int& s : some) s = label;
    for (; x < end && x <= stop; x += kAtOnce) __builtin_memcpy(row + x, some, sizeof some);
    for (; x < end; ++x) row[x] = label;
  });
}

}  // namespace
}  // namespace sdftrack::superpixels
