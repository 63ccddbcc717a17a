// SPDX-License-Identifier: MIT
// The loops of run_ops.h for the instruction set of the file that includes this. Several threads find roots
// and shorten ways at a time, always by numbers that are right before and after: relaxed atomics.
#pragma once

#include <array>
#include <atomic>
#include <bit>

#include "superpixels/row_packs.h"
#include "superpixels/run_ops.h"

namespace sdftrack {
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
HD Bits up_to(int bit) { return (Bits{2} << bit) - 1; }  // this one among them
HD Bits first_bits(int n) { return n >= 64 ? ~Bits{0} : (Bits{1} << n) - 1; }

int mark_row(RunTable t, int y, const std::uint8_t* codes, bool masked) {
  alignas(64) static constexpr auto kNone = [] {
    std::array<std::uint8_t, 64> none{};
    none.fill(kOutside);
    return none;
  }();
  Bits* const begins = t.begins + static_cast<std::ptrdiff_t>(y) * t.words;
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
// The same for all, with where they end: visit(run, x, end).
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

void start_row(RunTable t, int y, const std::uint8_t* codes, bool masked) {
  each_piece(t, y, [&](int run, int x, int end) SLIC_INLINE {
    t.parent[run] = masked && codes[x] == kOutside ? kNobody : x - end;
  });
}

HD int get(const int* p, int run) {
  return std::atomic_ref<int>(const_cast<int&>(p[run])).load(std::memory_order_relaxed);
}
HD void set(int* p, int run, int value) {
  std::atomic_ref<int>(p[run]).store(value, std::memory_order_relaxed);
}

// The first step without a branch, since there is no guessing it; seldom are there more.
HD int root_of(const int* parent, int run) {
  int up = get(parent, run);
  run = up < 0 ? run : up;
  while ((up = get(parent, run)) >= 0) run = up;
  return run;
}
// The later root gets the earlier one: whether there were two.
HD bool unite(int* parent, int run_a, int run_b) {
  const int a = root_of(parent, run_a), b = root_of(parent, run_b);
  if (a == b) return false;
  const int early = a < b ? a : b, late = a < b ? b : a;
  parent[early] += parent[late], parent[late] = early;
  if (late != run_a && early != run_a) parent[run_a] = early;
  if (late != run_b && early != run_b) parent[run_b] = early;
  return true;
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

int find_small_in_row(RunTable t, int y, std::int64_t min_size) {
  const Bits* const begins = t.row_begins(y);
  Bits* const marks = t.row_marks(y);
  int run = t.first[y], found = 0;
  for (int w = 0; w < t.words; ++w) {
    Bits small = 0;
    for (Bits left = begins[w]; left != 0; left &= left - 1, ++run) {
      const int root = root_of(t.parent, run);
      const int size = get(t.parent, root);
      set(t.parent, run, root == run ? size : root);
      t.best[run] = -1;
      small |= static_cast<Bits>(size > -min_size) << lowest(left);
    }
    marks[w] = small, found += count(small);
  }
  return found;
}

int keep_small_in_row(RunTable t, int y, std::int64_t min_size) {
  int found = 0;
  each_run(t, y, t.row_marks(y), [&](int run, int x) SLIC_INLINE {
    const int root = root_of(t.parent, run);
    if (root != run) set(t.parent, run, root);
    t.best[run] = -1;
    const bool small = get(t.parent, root) > -min_size;
    if (!small) t.row_marks(y)[x / 64] &= ~(Bits{1} << x % 64);
    found += small;
  });
  return found;
}

// A region as a neighbour: the larger, the better; of equals the first in the image. 0: none.
HD Bits worth(const RunTable& t, int root) {
  const int minus_size = get(t.parent, root);
  const Bits size = minus_size == kNobody ? 0 : static_cast<Bits>(-minus_size);
  return size == 0 ? 0 : size << 32 | static_cast<Bits>(INT_MAX - root);
}
HD int root_in(Bits worth) { return INT_MAX - static_cast<int>(worth & 0xffffffff); }

// visit(run) for the runs of row `there` that have pixels above or below x..end - 1: one after another.
// `before`: the last run of the words before that of x.
template <class Visit>
HD void each_beside(const RunTable& t, int there, int before, int x, int end, const Visit& visit) {
  const Bits* const begins = t.row_begins(there);
  int w = x / 64, run = before + count(begins[w] & up_to(x % 64)), more = 0;
  Bits left = begins[w] & ~up_to(x % 64);
  for (; 64 * (w + 1) < end; left = begins[++w]) more += count(left);
  more += count(left & up_to((end - 1) % 64));
  for (int last = run + more; run <= last; ++run) visit(run);
}

HD int run_end(const RunTable& t, const Bits* begins, int x) {
  int w = x / 64;
  Bits left = begins[w] & ~up_to(x % 64);
  while (left == 0 && ++w < t.words) left = begins[w];
  return left == 0 ? t.width : 64 * w + lowest(left);
}

// Other rows of the region offer theirs too: their order has no say.
HD void offer(const RunTable& t, int own, Bits best) {
  std::atomic_ref<int> chosen(t.best[own]);
  int old = chosen.load(std::memory_order_relaxed);
  while ((old < 0 || worth(t, old) < best) &&
         !chosen.compare_exchange_weak(old, root_in(best), std::memory_order_relaxed)) {
  }
}

void choose_row(RunTable t, int y) {
  const Bits *const begins = t.row_begins(y), *const marks = t.row_marks(y);
  const bool top = y == 0, bottom = y + 1 == t.height;
  int before = t.first[y] - 1, above = top ? 0 : t.first[y - 1] - 1, below = bottom ? 0 : t.first[y + 1] - 1;
  for (int w = 0; w < t.words; ++w) {
    for (Bits left = marks[w]; left != 0; left &= left - 1) {
      const int x = 64 * w + lowest(left), end = run_end(t, begins, x);
      const int run = before + count(begins[w] & up_to(x % 64)), own = root_of(t.parent, run);
      Bits best = 0;
      const auto tell = [&](int other) SLIC_INLINE {
        const int root = root_of(t.parent, other);
        const Bits of_this = root == own ? 0 : worth(t, root);
        best = of_this > best ? of_this : best;
      };
      if (x > 0) tell(run - 1);
      if (end < t.width) tell(run + 1);
      if (!top) each_beside(t, y - 1, above, x, end, tell);
      if (!bottom) each_beside(t, y + 1, below, x, end, tell);
      if (best != 0) offer(t, own, best);
    }
    before += count(begins[w]);
    if (!top) above += count(t.row_begins(y - 1)[w]);
    if (!bottom) below += count(t.row_begins(y + 1)[w]);
  }
}

bool join_choices_of_row(RunTable t, int y) {
  bool joined = false;
  each_run(t, y, t.row_marks(y), [&](int run, int) SLIC_INLINE {
    if (t.best[run] >= 0) joined |= unite(t.parent, run, t.best[run]);
  });
  return joined;
}

void write_row(RunTable t, int y, int first_label, bool last, int* labels) {
  constexpr int kAtOnce = 16;
  int* const row = labels + static_cast<std::ptrdiff_t>(y) * t.width;
  const int stop = last || t.width < kAtOnce ? t.width - kAtOnce : t.width;
  each_piece(t, y, [&](int run, int x, int end) SLIC_INLINE {
    const int number = t.parent[root_of(t.parent, run)];
    const int label = number == kNobody ? 0 : first_label - 1 - number;
    int some[kAtOnce];
    for (int& s : some) s = label;
    for (; x < end && x <= stop; x += kAtOnce) __builtin_memcpy(row + x, some, sizeof some);
    for (; x < end; ++x) row[x] = label;
  });
}

}  // namespace
}  // namespace sdftrack
