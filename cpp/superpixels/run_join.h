// SPDX-License-Identifier: MIT
// Joins runs that touch and have one centre into regions, and finally makes labels. Several threads find
// roots and shorten paths at once; each number is valid before and after a change: relaxed atomics.
#pragma once

#include <algorithm>
#include <array>
#include <atomic>
#include <bit>

#include "superpixels/row_packs.h"
#include "superpixels/run_ops.h"

namespace sdftrack::superpixels {

// Runs as bits, 64 pixels at a time, for the instruction set of the file that includes this.

namespace {

using Bits = std::uint64_t;

// A bit for each of 64 bytes that are equal.
HD Bits equal_bytes(const std::uint8_t* a, const std::uint8_t* b) {
#if defined(__AVX512BW__)
  return _mm512_cmpeq_epi8_mask(_mm512_loadu_si512(a), _mm512_loadu_si512(b));
#else
  Bits bits = 0;
#if defined(__AVX2__)
  for (int i = 0; i < 64; i += 32) {
    const __m256i same = _mm256_cmpeq_epi8(_mm256_loadu_si256((const __m256i*)(a + i)),
                                           _mm256_loadu_si256((const __m256i*)(b + i)));
    bits |= static_cast<Bits>(static_cast<unsigned>(_mm256_movemask_epi8(same))) << i;
  }
#elif defined(__SSE2__)
  for (int i = 0; i < 64; i += 16) {
    const __m128i same =
        _mm_cmpeq_epi8(_mm_loadu_si128((const __m128i*)(a + i)), _mm_loadu_si128((const __m128i*)(b + i)));
    bits |= static_cast<Bits>(static_cast<unsigned>(_mm_movemask_epi8(same))) << i;
  }
#else
  for (int i = 0; i < 64; ++i) bits |= static_cast<Bits>(a[i] == b[i]) << i;
#endif
  return bits;
#endif
}

HD int lowest(Bits bits) { return std::countr_zero(bits); }
HD int count(Bits bits) { return std::popcount(bits); }
HD Bits up_to(int bit) { return (Bits{2} << bit) - 1; }  // including this one
HD Bits first_bits(int n) { return n >= 64 ? ~Bits{0} : (Bits{1} << n) - 1; }

int mark_row(RunTable t, int y, const std::uint8_t* codes, bool masked) {
  alignas(64) static constexpr auto kNone = [] {
    std::array<std::uint8_t, 64> none{};
    none.fill(kOutside);
    return none;
  }();
  Bits* const begins = t.begins + y * t.words;
  Bits* const marks = t.row_marks(y);
  int runs = 0;
  for (int w = 0; w < t.words; ++w) {
    const std::uint8_t* const here = codes + 64 * w;
    const Bits row = first_bits(t.width - 64 * w);
    Bits begin = ~equal_bytes(here, here - 1) & row;
    if (w == 0) begin |= 1;
    Bits same = y > 0 ? equal_bytes(here, here - t.width) & row : 0;
    if (masked) same &= ~equal_bytes(here, kNone.data());
    begins[w] = begin, marks[w] = same;
    runs += count(begin);
  }
  return runs;
}

// visit(run, x) for the marked runs of row y, or for all.
template <class Visit>
HD void each_run(const RunTable& t, int y, const Bits* which, const Visit& visit) {
  const Bits* const begins = t.row_begins(y);
  int before = t.first[y] - 1;
  for (int w = 0; w < t.words; before += count(begins[w++]))
    for (Bits left = which[w]; left != 0; left &= left - 1) {
      const int bit = lowest(left);
      visit(before + count(begins[w] & up_to(bit)), 64 * w + bit);
    }
}
// The same for all runs, with their ends: visit(run, x, end).
template <class Visit>
HD void each_piece(const RunTable& t, int y, const Visit& visit) {
  const Bits* const begins = t.row_begins(y);
  int run = t.first[y], x = 0;
  for (int w = 0; w < t.words; ++w)
    for (Bits left = w == 0 ? begins[w] & ~Bits{1} : begins[w]; left != 0; left &= left - 1) {
      const int next = 64 * w + lowest(left);
      visit(run++, x, next), x = next;
    }
  visit(run, x, t.width);
}

HD int run_end(const RunTable& t, const Bits* begins, int x) {
  int w = x / 64;
  Bits left = begins[w] & ~up_to(x % 64);
  while (left == 0 && ++w < t.words) left = begins[w];
  return left == 0 ? t.width : 64 * w + lowest(left);
}

// visit(run) for the runs of row `there` that have pixels above or below x..end - 1: one after another.
// `before`: the last run of the words before that of x.
template <class Visit>
HD void each_beside(const RunTable& t, int there, int before, int x, int end, const Visit& visit) {
  const Bits* const begins = t.row_begins(there);
  int w = x / 64, run = before + count(begins[w] & up_to(x % 64)), more = 0;
  Bits left = begins[w] & ~up_to(x % 64);
  for (; 64 * (w + 1) < end; left = begins[++w]) more += count(left);
  more += count(left & up_to((end - 1) % 64));
  // Rarely more than two: visiting both without a branch avoids a misprediction.
  const int last = run + more;
  visit(run), visit(last);
  while (++run < last) visit(run);
}

HD int get(const int* p, int run) {
  return std::atomic_ref<int>(const_cast<int&>(p[run])).load(std::memory_order_relaxed);
}
HD void set(int* p, int run, int value) {
  std::atomic_ref<int>(p[run]).store(value, std::memory_order_relaxed);
}

// One step towards the root; a root stays. A run's parent is never a later run, and as an unsigned number the
// value of a root is larger than all. Without a branch, because it cannot be predicted.
HD int next_root(const int* parent, int run) {
  return int(std::min(static_cast<unsigned>(run), static_cast<unsigned>(get(parent, run))));
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
  int* const row = labels + y * t.width;
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
